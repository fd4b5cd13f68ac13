# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that share an axis have one unit, which a heading says once."""

from armid_ros.estimate import Estimate, ParameterName
from armid_ros.report.families import parameter_families
from armid_ros.report.sections.parameters import ParameterSection
import numpy as np

NAMES = (
    ParameterName('m2', 'lift', 'kg'),
    ParameterName('viscous_coefficient', 'turn', 'N m s/rad'),
    ParameterName('viscous_coefficient', 'lift', 'N s/m'),
)


def test_joints_that_slide_and_that_turn_are_kept_apart():
    assert parameter_families(NAMES) == {
        ('Masses', 'kg'): [0],
        ('Viscous coefficient', 'N m s/rad'): [1],
        ('Viscous coefficient', 'N s/m'): [2],
    }


def test_a_heading_has_its_unit_once():
    estimate = Estimate(NAMES, np.ones(3), 0.01 * np.eye(3))
    text = ParameterSection(estimate, np.ones(3)).html()
    assert '<summary>Viscous coefficient [N s/m]: 1</summary>' in text
    assert '[N s/m] [' not in text
