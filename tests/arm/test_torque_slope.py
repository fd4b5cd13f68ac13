# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The slope of the torque is its derivative, whichever effects the arm has."""

from armid_ros.arm import ArmModel, TorqueSlope
from armid_ros.effects import make_effect
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
import numpy as np
import pytest

STEP = 1e-6
ARMS = {
    'bare': {},
    'linear': {'viscous_friction': 0.3, 'rotor_inertia': 0.1, 'torque_offset': 0.2},
    'load': {'coulomb_friction': 0.3, 'load_dependent_friction': 0.2, 'encoder_offset': 0.02},
    'laws': {'stribeck_friction': 0.4, 'quadratic_friction': 0.1, 'torque_ripple': 0.3},
    'links': {'joint_spring': 2.0, 'joint_coupling': 1.0},
    'history': {'presliding_hysteresis': 0.8},
}


def paths(joints, x):
    """Return a smooth motion with reversals, of amplitudes x, shape (n, 3)."""
    t = np.linspace(0.0, 4.0, 160)
    k = np.pi * np.arange(1, 4) + 0.1
    angle = np.multiply.outer(t, k)
    return Motion(
        joints, t, np.sin(angle) @ x.T, (k * np.cos(angle)) @ x.T, (-(k**2) * np.sin(angle)) @ x.T
    )


@pytest.mark.parametrize('effects', ARMS.values(), ids=ARMS.keys())
def test_slope_is_the_derivative_along_any_change(effects):
    robot = load_robot('humanoid_arm')
    arm = ArmModel(robot)
    for name, value in effects.items():
        effect = make_effect(name, robot)
        arm = arm.with_effect(effect, np.full(len(effect.parameters(robot)), value))
    rng = np.random.default_rng(1)
    x, change = rng.normal(size=(2, robot.n_joints, 3)) / 4.0
    motion, along = paths(robot.joints, x), paths(robot.joints, change)
    weights = rng.normal(size=motion.q.shape)
    slopes = TorqueSlope.of(arm, motion).pullback(weights)
    analytic = sum(
        np.sum(by * way) for by, way in zip(slopes, (along.q, along.dq, along.ddq), strict=True)
    )
    ends = [
        np.sum(weights * arm.joint_torque(paths(robot.joints, x + step * change)))
        for step in (STEP, -STEP)
    ]
    assert analytic == pytest.approx((ends[0] - ends[1]) / (2.0 * STEP), rel=1e-5)
