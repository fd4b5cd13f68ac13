# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that share an axis have one unit; labels are short; convergence has intervals."""

from armid_ros.estimate import Estimate, ParameterName
from armid_ros.report.blocks import DataTable, Paragraph
from armid_ros.report.identification_report import convergence_section
from armid_ros.report.notation import common_prefix
from armid_ros.report.page import Page, Section
from armid_ros.report.parameter_tables import (
    full_label,
    grouping,
    parameter_folds,
    parameter_section,
)
import numpy as np
import pytest

NAMES = (
    ParameterName('m2', 'lift', 'kg'),
    ParameterName('viscous_coefficient', 'turn', 'N m s/rad'),
    ParameterName('viscous_coefficient', 'lift', 'N s/m'),
)


def test_joints_that_slide_and_that_turn_are_kept_apart():
    folds = parameter_folds(NAMES, (), lambda _: ())
    assert [fold.summary for fold in folds] == [
        'Link of lift: 1',
        'Viscous coefficient [N m s/rad]: 1',
        'Viscous coefficient [N s/m]: 1',
    ]


@pytest.mark.parametrize(
    ('name', 'label'),
    [
        ('m2', 'mass of forearm'),
        ('mx1', 'first moment along x of upper arm'),
        ('Izz2', 'moment of inertia about z of forearm'),
        ('Ixy2', 'product of inertia xy of forearm'),
        ('Iyy1 + 0.25 (m2 + mz2)', 'moment of inertia about y of upper arm + others'),
    ],
)
def test_a_parameter_of_a_link_is_said_in_words(name, label):
    links = ('upper arm', 'forearm')
    assert full_label(ParameterName(name, 'elbow', ''), links) == label
    unnamed = full_label(ParameterName(name, 'elbow', ''))
    assert 'elbow' in unnamed and not any(link in unnamed for link in links)


def test_a_group_is_a_sum_over_named_links():
    name = ParameterName('Iyy1 - 0.25 (m2 + mz2)', 'shoulder', 'kg m^2')
    links = ('upper arm', 'forearm')
    words = grouping(name, links)
    for link, symbol in (('upper arm', 'Iyy'), ('forearm', 'm'), ('forearm', 'mz')):
        assert f'{symbol} of {link}' in words
    assert grouping(ParameterName('m2', 'elbow', 'kg'), links) == ''
    estimate = Estimate((name,), np.ones(1), 0.01 * np.eye(1))
    page = parameter_section(estimate, np.ones(1), links=links).html()
    assert f'<small>{words}' in page


PANDA = tuple(f'panda_joint{number}' for number in range(1, 8))


@pytest.mark.parametrize(
    ('names', 'prefix'),
    [
        (PANDA, 'panda_'),
        (('lbr_iiwa_joint_1', 'lbr_iiwa_joint_2'), 'lbr_iiwa_'),
        (('joint_1', 'joint_2'), ''),
        (('ur_pan', 'ur_lift'), ''),
        (('panda_joint1',), ''),
    ],
)
def test_a_long_prefix_before_a_letter_is_common(names, prefix):
    assert common_prefix(names) == prefix


def test_labels_of_a_page_have_short_names_and_sentences_whole_ones():
    others = 'bags/panda_joint2', 'panda_joint2.mcap', 'panda_joint21'
    blocks = (
        Paragraph('See panda_joint3.'),
        DataTable(('Joint',), [(one,) for one in ('panda_joint2', *others)]),
    )
    page = Page('', '', Paragraph(''), [Section('A', blocks)], names=PANDA).html()
    for text in ('See panda_joint3', '>joint2<', *(f'>{one}<' for one in others)):
        assert text in page


def test_parameters_are_drawn_with_interval_and_truth(case):
    estimate = case.result.estimate
    t = np.linspace(0.5, 10.0, 50)
    std = estimate.std * np.sqrt(10.0 / t)[:, np.newaxis]
    values = estimate.values + std
    history = [
        (at, Estimate(estimate.parameters, v, np.diag(s**2)))
        for at, v, s in zip(t, values, std, strict=True)
    ]
    section = convergence_section(history, estimate.values)
    _, panels = section.blocks
    shown = {full_label(name): k for k, name in enumerate(estimate.parameters)}
    assert len(panels.panels) == 6
    units = {estimate.parameters[shown[label]].unit for label, *_ in panels.panels}
    assert {'kg m^2', 'N m'} <= units
    for label, _, (chart,) in panels.panels:
        k = shown[label]
        band, curve = chart.series
        drawn = np.isfinite(curve.y)
        assert drawn[-1]
        np.testing.assert_allclose(curve.y[drawn], values[drawn, k])
        np.testing.assert_allclose((band.upper - band.y)[drawn], 3.92 * std[drawn, k], rtol=1e-3)
        assert chart.levels[0][0] == estimate.values[k]
