# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The ground of Table 3, the wearer, the shipped gait, and feet that stay where they stand."""

from armid_ros.model import inverse_dynamics, random_motion
from armid_ros.motion import Motion
from armid_ros.papers.exo.plant.gait import read_gait, stance_motion
from armid_ros.papers.exo.plant.walkers import (
    columns,
    foot_points,
    ground_force,
    HEEL_DOWN,
    LegLength,
    TOE_DOWN,
    walkable,
    walker,
)
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


@pytest.mark.parametrize(
    ('height', 'upwards', 'sliding', 'force'),
    [
        (-1e-3, 0.0, 0.0, [0.0, 100.0]),
        (1e-6, -3.0, 1.0, [0.0, 0.0]),
        (-1e-3, 2.0, 1.0, [0.0, 0.0]),
        (-1e-9, -0.2, 0.0, [0.0, 200.0]),
        (-1e-3, 0.0, 1.0, [-30.0, 100.0]),
        (-1e-3, 0.0, -1.0, [30.0, 100.0]),
    ],
    ids=['deep', 'above', 'leaving', 'first touch', 'sliding ahead', 'sliding back'],
)
def test_the_ground_pushes_damps_and_rubs_and_never_pulls(height, upwards, sliding, force) -> None:
    found = ground_force(*(np.array(part) for part in (height, upwards, sliding)))
    np.testing.assert_allclose(found, force, rtol=1e-4)


LEG = LegLength(thigh=0.3605, shank=0.3854, foot=0.2572)


@pytest.fixture(scope='module')
def plan():
    return walkable(read_gait(), LEG, 1.2)


def feet(plan):
    phase = np.arange(len(plan.hips)) / len(plan.hips)
    way = np.outer(phase, [plan.stride, 0.0])
    return phase, *foot_points(plan.gait(phase), plan.hips + way, plan.lean, LEG)


def test_heel_and_toe_stay_where_they_stand(plan) -> None:
    phase, heel, toe = feet(plan)
    for point, place, (begin, end) in (
        (heel, [0.0, 0.0], HEEL_DOWN),
        (toe, [LEG.foot, 0.0], TOE_DOWN),
    ):
        down = (phase >= begin) & (phase <= end)
        np.testing.assert_allclose(point[down], np.tile(place, (down.sum(), 1)), atol=2e-3)


def test_the_swing_foot_clears_the_ground(plan) -> None:
    phase, heel, toe = feet(plan)
    swing = (phase > 0.68) & (phase < 0.92)
    assert min(heel[swing, 1].min(), toe[swing, 1].min()) > 0.01


def test_curves_of_hip_and_knee_stay_near_those_asked_for(plan) -> None:
    phase = np.linspace(0.0, 1.0, 101)
    off = np.degrees(plan.gait(phase) - read_gait()(phase))[:, :2]
    assert np.sqrt(np.mean(off**2, axis=0)).max() < 3.0


JOINTS = tuple('abcdef')


def test_the_shipped_gait_has_the_ranges_of_the_source() -> None:
    hip, knee, _ = np.degrees(read_gait()(np.linspace(0.0, 1.0, 2001))).T
    assert (hip.min(), hip.max()) == (
        pytest.approx(-20.0, abs=0.01),
        pytest.approx(40.0, abs=0.01),
    )
    assert (knee.min(), knee.max()) == (
        pytest.approx(0.0, abs=0.01),
        pytest.approx(65.0, abs=0.01),
    )


def test_a_gait_is_periodic_and_knows_its_derivatives() -> None:
    gait, phase, h = read_gait(), np.linspace(0.0, 1.0, 50), 1e-5
    np.testing.assert_allclose(gait(phase), gait(phase + 1.0), atol=1e-12)
    for order in (0, 1):
        slope = (gait(phase + h, order) - gait(phase - h, order)) / (2.0 * h)
        np.testing.assert_allclose(slope, gait(phase, order + 1), atol=1e-5)


def test_the_stance_foot_is_flat_the_trunk_upright_and_legs_are_half_a_cycle_apart() -> None:
    t = np.linspace(0.0, 1.2, 101)
    phase = np.array([t / 1.2, np.full_like(t, 1.0 / 1.2), np.zeros_like(t)])
    motion = stance_motion(JOINTS, t, phase)
    for part in (motion.q, motion.dq, motion.ddq):
        np.testing.assert_allclose(part[:, 0] - part[:, 1] + part[:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.q[:51, 3], motion.q[50:, 2], atol=1e-9)
