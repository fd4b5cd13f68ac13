# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Two machines tied by springs: statics, exercises, and their sensors."""

from dataclasses import replace
from itertools import islice

from armid_ros.errors import ModelError
from armid_ros.model import random_motion
from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.papers.exo.plant.leg_pair import (
    exercise,
    EXERCISES,
    leg_pair,
    pair_torques,
    PairMotion,
    stepping,
    TiedPair,
)
from armid_ros.papers.exo.plant.simulated_pair import PairSample, sensor_readings
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


def simulated(count: int, **options) -> list[PairSample]:
    rng = np.random.default_rng(0)
    return list(islice(sensor_readings(leg_pair(), read_gait(), rng=rng, **options), count))


def test_without_noise_it_is_the_gait_and_its_torques():
    pair, samples = leg_pair(), simulated(120)
    motions = stepping(pair, read_gait(), np.array([s.t for s in samples]))
    np.testing.assert_allclose([s.q for s in samples], motions.own.q, atol=1e-12)
    np.testing.assert_allclose([s.other_q for s in samples], motions.other.q, atol=1e-12)
    np.testing.assert_allclose(
        [s.tau for s in samples], pair_torques(pair, *motions).tau, atol=1e-9
    )


def test_noise_has_the_size_asked_for_and_comes_from_the_seed():
    noise = {'angle_noise': 1e-3, 'torque_noise': 0.5}
    triples = list(zip(*(simulated(200, **one) for one in (noise, noise, {})), strict=True))
    errors = np.array([a.q - c.q for a, _, c in triples])
    assert errors.std() == pytest.approx(1e-3, rel=0.1)
    assert np.array([a.tau - c.tau for a, _, c in triples]).std() == pytest.approx(0.5, rel=0.1)
    assert all(np.array_equal(a.q, b.q) for a, b, _ in triples)
