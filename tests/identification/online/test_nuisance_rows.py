# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction as a nuisance: what the effects of the catalogue make of it, and no more of it."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.online.change_watch import NuisanceRows, Row
from armid_ros.identification.rows.causal import CausalMotion
from armid_ros.motion import Motion
from armid_ros.robots import load_robot
import numpy as np


def arm_with(*names: str) -> ArmModel:
    arm = ArmModel(load_robot('humanoid_arm'))
    for name in names:
        arm = arm.with_effect(make_effect(name, arm.robot))
    return arm


def row(q, dq, ddq) -> Row:
    """Return the first row of a stretch, which filters leave as it is."""
    return Row(0.0, None, CausalMotion(0.0, q, dq, ddq, q), 0.005, 1.0, begins=True)


def test_columns_are_those_of_the_effects_that_the_arm_lacks():
    arm = arm_with()
    stribeck = make_effect('stribeck_friction', arm.robot)
    lacking = (
        make_effect('viscous_friction', arm.robot),
        make_effect('coulomb_friction', arm.robot),
        *(stribeck.with_shape((velocity, 2.0)) for velocity in (0.03, 0.1, 0.3)),
        make_effect('load_dependent_friction', arm.robot),
    )
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, arm.robot.n_joints))
    nuisance = NuisanceRows(arm, 5.0)
    one = Motion(arm.robot.joints, np.zeros(1), q[None], 0.2 * dq[None], ddq[None])
    (rows,) = nuisance.columns([row(q, 0.2 * dq, ddq)])
    expected = np.concatenate([effect.columns(one, arm)[0] for effect in lacking], axis=1)
    np.testing.assert_allclose(rows, expected, atol=1e-12)
    assert [p.joint for p in nuisance.parameters] == list(arm.robot.joints) * len(lacking)


def test_what_is_identified_is_not_nuisance():
    everything = arm_with(
        'viscous_friction', 'coulomb_friction', 'stribeck_friction', 'load_dependent_friction'
    )
    nuisance = NuisanceRows(everything, 5.0)
    assert nuisance.parameters == ()
    n = everything.robot.n_joints
    assert nuisance.columns([row(*np.ones((3, n)))]).shape == (1, n, 0)
