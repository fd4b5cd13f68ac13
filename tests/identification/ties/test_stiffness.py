# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs between two machines, found from the torques of one and noisy angles of both."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification.ties.problem import interaction_problem
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.model.spring_ties import TiedMachines
from armid_ros.papers.exo.plant.leg_pair import (
    leg_pair,
    PairMotion,
    stepping,
    TiedPair,
    with_noise,
    with_torques,
)
import numpy as np
import pytest
from scipy.stats import chi2

from benchmarks.exo import find_springs, recorded

STIFFNESS = 1.0e4


@pytest.fixture(scope='module')
def pair() -> TiedPair:
    return leg_pair(STIFFNESS)


@pytest.fixture(scope='module')
def poses(pair) -> PairMotion:
    """Return 200 poses, with exact torques."""
    motions = stepping(pair, np.linspace(0.0, 1.8, 201)[:-1])
    return with_torques(pair, motions)


@pytest.fixture(scope='module')
def seconds(pair) -> PairMotion:
    """Return 6 s at 1 kHz, with exact torques."""
    return with_torques(pair, stepping(pair, np.arange(0.0, 6.0, 1e-3)))


def percent(found: Interaction) -> np.ndarray:
    return np.asarray(100.0 * (found.stiffness / STIFFNESS - 1.0))


@pytest.mark.parametrize('inertias', ['known', 'free'])
@pytest.mark.parametrize('separate', [False, True])
def test_exact_data_give_exact_stiffness(pair, poses, inertias, separate) -> None:
    problem = interaction_problem(
        pair,
        poses.own,
        poses.other,
        inertias=inertias,
        separate=separate,
        noise=(0.0, 1e-3),
    )
    found = identify_interaction(problem)
    np.testing.assert_allclose(found.stiffness, STIFFNESS, rtol=1e-5)


def test_noise_of_a_tenth_of_a_degree_leaves_no_bias_in_200_poses(pair, poses) -> None:
    """The mean over draws, to the error of that mean; plain least squares is off by much more."""
    found = [find_springs(pair, poses, 0.1, seed) for seed in range(8)]
    ends = [part.interval()[0] for part in found]
    assert np.mean([lower <= STIFFNESS <= upper for lower, upper in ends]) >= 0.85
    biased = np.mean([100.0 * part.bias[0] / STIFFNESS for part in found])
    mean, scatter = np.mean([percent(f) for f in found]), np.std([percent(f) for f in found])
    assert biased < -3.0
    assert abs(mean) < 1.0
    assert abs(mean) < 3.0 * scatter / np.sqrt(len(found)) + 0.1


@pytest.mark.parametrize(('inertias', 'one', 'each'), [('known', 0.5, 5.0), ('free', 1.0, 5.0)])
def test_a_recording_gives_them_within_per_cent(pair, seconds, inertias, one, each) -> None:
    overall = find_springs(pair, seconds, 0.05, 0, inertias=inertias)
    assert abs(percent(overall)[0]) < one
    apart = find_springs(pair, seconds, 0.05, 0, inertias=inertias, separate=True)
    assert np.abs(percent(apart)).max() < each
    louder = find_springs(pair, seconds, 0.1, 0).position_noise
    np.testing.assert_allclose(louder / overall.position_noise, 2.0, rtol=0.2)


def test_recordings_need_not_begin_together(pair, seconds) -> None:
    own, other = with_noise(seconds, np.radians(0.05), 0.5, np.random.default_rng(0))
    late = other.select(slice(700, None))
    late = recorded(replace(late, t=late.t - late.t[0]), start_ns=700 * 10**6)
    found = identify_interaction(recorded_interaction_problem(pair, recorded(own), late))
    assert abs(percent(found)[0]) < 0.5


def test_without_springs_none_are_found(pair) -> None:
    loose = pair.with_stiffness(0.0)
    still = with_torques(loose, stepping(loose, np.linspace(0.0, 1.8, 200)))
    found = find_springs(loose, still, 0.05, 0)
    lower, upper = found.interval(0.999)[0]
    assert lower < 0.0 < upper
    assert upper < 100.0


def test_data_that_cannot_tell_are_refused(pair, poses) -> None:
    same = replace(poses.own, q=poses.other.q)
    one = TiedMachines(pair.robot, pair.other, pair.ties[:1])
    problem = interaction_problem(one, same, poses.other)
    with pytest.raises(IdentificationError, match='never stretches'):
        identify_interaction(problem)
    with pytest.raises(IdentificationError, match='no torques'):
        interaction_problem(pair, poses.own.with_torque(None), poses.other)
    with pytest.raises(IdentificationError, match='times; interpolate'):
        shifted = replace(poses.other, t=poses.other.t + 0.1)
        interaction_problem(pair, poses.own, shifted)


@pytest.mark.long
@pytest.mark.parametrize(
    ('times', 'draws'),
    [(np.linspace(0.0, 1.8, 101)[:-1], 150), (np.arange(0.0, 3.0, 1e-3), 60)],
    ids=['poses', 'recording'],
)
def test_deviations_that_are_stated_are_those_of_repeats(pair, times, draws) -> None:
    """
    The scatter of one stiffness over draws, within what so many draws can tell.

    As if rows of a recording were independent the deviations would be a third too small.

    """
    motions = with_torques(pair, stepping(pair, times))
    found = [find_springs(pair, motions, 0.05, seed) for seed in range(draws)]
    values = np.array([part.stiffness[0] for part in found])
    stated = np.mean([part.std[0] ** 2 for part in found])
    ratio = values.var(ddof=1) / stated
    low, high = chi2.ppf([0.0005, 0.9995], len(found) - 1) / (len(found) - 1)
    assert low < ratio < high


def test_inertias_of_links_that_hardly_turn_stay_near_their_description(pair) -> None:
    """The trunk's inertia is a column of noise: without a belief its best value is infinite."""
    real = leg_pair(3e3, ('stance_thigh',))
    motions = with_torques(real, stepping(real, np.arange(0.0, 4.0, 1e-3)))
    readings = with_noise(motions, np.radians(0.05), 0.5, np.random.default_rng(9))
    sides = (recorded(side) for side in readings)
    problem = recorded_interaction_problem(pair, *sides, inertias='free', separate=True)
    found = identify_interaction(problem)
    away = found.estimate.values - problem.described
    spread = np.sqrt(np.diag(np.linalg.inv(problem.precision[4:, 4:])))
    assert np.all(np.abs(away[4:]) < 3.0 * spread)
