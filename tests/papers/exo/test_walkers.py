# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A body on one foot, hung from its trunk: the same body."""

from armid_ros.model import inverse_dynamics, random_motion
from armid_ros.motion import Motion
from armid_ros.papers.exo.plant.walkers import columns, floating, walker
from armid_ros.robots import load_robot
import numpy as np
import pytest

NAMES = ('exoskeleton_legs', 'human_legs')


@pytest.mark.parametrize('name', NAMES)
def test_a_swing_leg_takes_the_same_torque_from_either_root(name) -> None:
    """Hips that hold still: a leg does not know what carries them."""
    standing, free = load_robot(name), walker(load_robot(name))
    rng = np.random.default_rng(1)
    leg = random_motion(standing, rng, 20)
    legs = [standing.index(j) for j in standing.joints if 'swing' in j]
    parts = np.zeros((3, 20, standing.n_joints))
    hung = np.zeros((3, 20, free.n_joints))
    for k, part in enumerate((leg.q, leg.dq, leg.ddq)):
        parts[k][:, legs] = part[:, legs]
        hung[k][:, columns(free, 'left')] = part[:, legs]
    tau = inverse_dynamics(standing, Motion(standing.joints, leg.t, *parts))[:, legs]
    again = inverse_dynamics(free, Motion(free.joints, leg.t, *hung))
    np.testing.assert_allclose(again[:, columns(free, 'left')], tau, atol=1e-10)


@pytest.mark.parametrize('name', NAMES)
def test_hips_carry_the_weight(name) -> None:
    free = walker(load_robot(name))
    still = np.zeros((1, free.n_joints))
    tau = inverse_dynamics(free, Motion(free.joints, np.zeros(1), still, still, still))
    ahead, up, _ = floating(free)
    weight = 9.81 * free.rigid_parameters[::10].sum()
    assert tau[0, up] == pytest.approx(weight, rel=1e-3)
    assert tau[0, ahead] == pytest.approx(0.0, abs=1e-9)
