# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The convergence of an online estimate is drawn with its intervals and the true values."""

from armid_ros.report.families import full_label
from armid_ros.report.identification_report import Assessment, identification_report
from armid_ros.report.sections.convergence import convergence_section
import numpy as np


def test_parameters_are_drawn_with_interval_and_truth(case):
    estimate = case.result.estimate
    t = np.linspace(0.5, 10.0, 50)
    std = estimate.std * np.sqrt(10.0 / t)[:, np.newaxis]
    values = estimate.values + std
    section = convergence_section(t, values, std, estimate.values, estimate.parameters)
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
        assert chart.levels[0].y == estimate.values[k]


def test_a_page_can_compare_with_the_truth_and_have_more_sections(case):
    estimate = case.result.estimate
    t, ones = np.array([1.0, 2.0]), np.ones((2, 1))
    section = convergence_section(
        t, ones * estimate.values, ones * estimate.std, estimate.values, estimate.parameters
    )
    page = identification_report(
        case.result,
        description=case.truth,
        robot='humanoid_arm',
        recordings=case.recordings[:1],
        validation={},
        assessment=Assessment(reference='truth', sections=[section]),
    )
    assert '>Truth</th>' in page and '>Description</th>' not in page
    assert f'>{section.title}</h2>' in page
