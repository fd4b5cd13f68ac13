# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The convergence of an online estimate is drawn with its intervals and the true values."""

from armid_ros.estimate import Estimate
from armid_ros.report.identification_report import convergence_section
from armid_ros.report.parameter_tables import full_label
import numpy as np


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
