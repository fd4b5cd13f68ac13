# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rigid-body model of an arm: inverse dynamics, regressor, base parameters and link frames."""

from armid_ros.model.base_parameters import BaseParameters, group_columns, levelled, regroup
from armid_ros.model.kinematics import LinkFrames, points_motion
from armid_ros.model.rigid_body import (
    gravity_sensitivity,
    inverse_dynamics,
    inverse_dynamics_derivatives,
    LINK_PARAMETERS,
    random_motion,
    regressor,
    rigid_parameter_names,
)

__all__ = [
    'BaseParameters',
    'LINK_PARAMETERS',
    'LinkFrames',
    'gravity_sensitivity',
    'group_columns',
    'inverse_dynamics',
    'inverse_dynamics_derivatives',
    'levelled',
    'points_motion',
    'random_motion',
    'regressor',
    'regroup',
    'rigid_parameter_names',
]
