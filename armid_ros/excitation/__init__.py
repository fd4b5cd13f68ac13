# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Excitation: trajectories that make the parameters of an arm visible.

`design` finds a `FourierTrajectory` inside the `Limits` of a robot that shows the parameters of
an `ArmModel` best; an `Excitation` runs through it from rest to rest.

"""

from armid_ros.excitation.criteria import CRITERIA, Information
from armid_ros.excitation.design import Design, design, evaluate, Progress
from armid_ros.excitation.files import load_excitation, save_excitation
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.limits import (
    check_limits,
    Limits,
    require_within,
    SPEED_CLASSES,
    Violation,
)
from armid_ros.excitation.problem import DesignSettings, Problem, TARGETS
from armid_ros.excitation.random import random_feasible
from armid_ros.excitation.schedule import Excitation

__all__ = [
    'CRITERIA',
    'Design',
    'DesignSettings',
    'Excitation',
    'FourierTrajectory',
    'Information',
    'Limits',
    'Problem',
    'Progress',
    'SPEED_CLASSES',
    'TARGETS',
    'Violation',
    'check_limits',
    'design',
    'evaluate',
    'load_excitation',
    'random_feasible',
    'require_within',
    'save_excitation',
]
