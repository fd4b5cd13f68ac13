# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Two machines tied by springs: statics, exercises, and their sensors."""

from dataclasses import replace

from armid_ros.errors import ModelError
from armid_ros.model import random_motion
from armid_ros.papers.exo.plant.leg_pair import (
    exercise,
    EXERCISES,
    leg_pair,
    pair_torques,
    PairMotion,
    stepping,
    TiedPair,
    with_noise,
    with_torques,
)
import numpy as np
import pytest

STIFFNESS = np.array([1.0e4, 2.0e4, 5.0e3, 3.0e4])


@pytest.fixture(scope='module')
def pair() -> TiedPair:
    return leg_pair(STIFFNESS)


@pytest.fixture(scope='module')
def motions(pair) -> PairMotion:
    rng = np.random.default_rng(0)
    own, other = (random_motion(robot, rng, 40) for robot in (pair.robot, pair.other))
    return PairMotion(own, other)


def test_action_equals_reaction(pair, motions) -> None:
    """What the springs do to both, force and moment about the base, is nothing in all."""
    geometry = pair.geometry(*motions)
    forces = pair.forces(geometry.way)
    shift = np.cross(geometry.position - geometry.other_position, forces)
    np.testing.assert_allclose(shift / np.abs(forces).max(), 0.0, atol=1e-12)
    both = pair_torques(pair, *motions)
    without = pair_torques(pair.with_stiffness(0.0), *motions)
    own = np.einsum('nsxj,nsx->nj', geometry.jacobian, forces)
    other = np.einsum('nsxj,nsx->nj', geometry.other_jacobian, -forces)
    np.testing.assert_allclose(without.tau - both.tau, own, atol=1e-9)
    np.testing.assert_allclose(without.other_tau - both.other_tau, other, atol=1e-9)


def test_same_posture_no_interaction(pair, motions) -> None:
    """The exoskeleton fits its wearer: springs are relaxed where all angles agree."""
    same = replace(motions.own, q=motions.other.q)
    assert np.abs(pair.forces(pair.geometry(same, motions.other).way)).max() < 1e-9


def test_a_slack_spring_pulls_where_it_is_drawn_out_further() -> None:
    way = np.array([[[0.003, 0.0, 0.0], [0.0, 0.0, 0.02]]])
    loose = leg_pair([1e4, 1e4], ('swing_shank', 'swing_thigh')).with_slack(0.005)
    force = loose.forces(way)
    np.testing.assert_allclose(force[0], [[0.0, 0.0, 0.0], [0.0, 0.0, -150.0]], atol=1e-9)


def test_a_segment_that_is_none_is_refused() -> None:
    with pytest.raises(ModelError, match='swing_shank'):
        leg_pair(segments=('left_arm',))
    with pytest.raises(ModelError, match='4 straps'):
        leg_pair([1.0, 2.0])
    with pytest.raises(ModelError, match='not negative'):
        leg_pair(-1.0)


PAIR = leg_pair()
T = np.linspace(0.0, 2.0, 2001)


@pytest.mark.parametrize('name', EXERCISES)
def test_velocity_and_acceleration_are_those_of_the_position(name) -> None:
    for motion in exercise(PAIR, name, T):
        speed = np.gradient(motion.q, T, axis=0)[5:-5]
        hurry = np.gradient(motion.dq, T, axis=0)[5:-5]
        np.testing.assert_allclose(motion.dq[5:-5], speed, atol=2e-3)
        np.testing.assert_allclose(motion.ddq[5:-5], hurry, atol=3e-2)


@pytest.mark.parametrize('name', EXERCISES)
def test_knees_bend_one_way_and_the_stance_foot_is_flat(name) -> None:
    wearer = exercise(PAIR, name, T).other
    ankle, knee, hip, _, far_knee, _ = wearer.q.T
    assert min(knee.min(), far_knee.min()) > -0.05
    np.testing.assert_allclose(ankle, knee - hip, atol=1e-12)


def test_noise_has_the_size_asked_for_and_comes_from_the_seed() -> None:
    exact = with_torques(PAIR, stepping(PAIR, T))
    one, again = (with_noise(exact, 1e-3, 0.5, np.random.default_rng(0)) for _ in range(2))
    for found, true in zip(one, exact, strict=True):
        assert (found.q - true.q).std() == pytest.approx(1e-3, rel=0.1)
    assert (one.own.tau - exact.own.tau).std() == pytest.approx(0.5, rel=0.1)
    np.testing.assert_array_equal(one.own.q, again.own.q)
