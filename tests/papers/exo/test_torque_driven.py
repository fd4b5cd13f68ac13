# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that follow torques, in this package's engine and in MuJoCo."""

from itertools import islice

from armid_ros.errors import TrajectoryError
from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.papers.exo.plant.leg_pair import (
    leg_pair,
    pair_torques,
    PairMotion,
    stepping,
    TiedPair,
)
from armid_ros.papers.exo.plant.simulated_pair import PairSample, sensor_readings
from armid_ros.papers.exo.plant.torque_driven import drive_by_torque, splined
import numpy as np
import pytest

from tests.papers.exo.pair_in_mujoco import drive_in_mujoco

RATE = 100.0
#: How far joints are off with springs that are 20 % too soft [deg].
DRIVEN = {'exo_swing_hip': 1.14, 'exo_swing_knee': 2.81}


@pytest.fixture(scope='module')
def pair() -> TiedPair:
    return leg_pair()


@pytest.fixture(scope='module')
def motions(pair) -> PairMotion:
    return stepping(pair, read_gait(), np.linspace(0.0, 0.456, 229), 0.912)


def most(error: np.ndarray) -> float:
    return float(np.degrees(np.abs(error).max()))


@pytest.mark.parametrize('joint', DRIVEN)
def test_springs_believed_too_soft_lead_both_engines_astray_alike(pair, motions, joint) -> None:
    soft = pair.with_stiffness(0.8 * pair.stiffness)
    column = [pair.robot.index(joint)]
    torque = splined(motions.own.t, pair_torques(soft, *motions).tau[:, column], RATE)
    followed = drive_by_torque(pair, *motions, [joint], torque).q[:, column]
    assert most(followed - motions.own.q[::2, column]) == pytest.approx(DRIVEN[joint], abs=0.02)
    path = drive_in_mujoco(pair, motions, [joint], torque)[::2]
    assert most(path - followed) < 0.01


def test_an_even_number_of_samples_is_refused(pair) -> None:
    even = stepping(pair, read_gait(), np.linspace(0.0, 0.4, 20))
    with pytest.raises(TrajectoryError, match='odd'):
        drive_by_torque(pair, *even, ['exo_swing_hip'], lambda t: np.zeros(1))


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
