# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that share an axis have one unit, which a heading says once."""

from armid_ros.estimate import Estimate, ParameterName
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
