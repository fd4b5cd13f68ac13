# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Columns that are made of the measured torque follow its noise, and that is no cause."""

from dataclasses import replace

from armid_ros.diagnosis.data.evidence import Evidence, noise_floor
from armid_ros.diagnosis.data.rows import make_problem
from armid_ros.diagnosis.data.trajectory import trajectories, Workspace
from armid_ros.diagnosis.search.acceptance import without_echo
from armid_ros.diagnosis.search.held_out import held_out
from armid_ros.diagnosis.search.search_state import Nuisance, SearchState
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import CATALOGUE
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

USED = Conditioning(200.0, 20.0, 5)


def tried(bench, seed, level=0.6, lost=0.0, loud=2.0):
    """Return a drive that loses torque, as it is tried and without its echo; noise is white."""
    noisy = [
        replace(one, tau=one.tau + loud * np.random.default_rng(seed).normal(size=one.tau.shape))
        for one in bench.recordings(lambda motion, tau: beyond(tau, level, lost), seed=seed)
    ]
    data = tuple(trajectories(noisy, USED))
    noise = tuple(noise_floor(part, bench.arm).sigma for part in data)
    effect = CATALOGUE['actuator_saturation'].on(bench.robot, ('elbow',))
    highest = max(np.abs(bench.torque(part.motion)[:, 1]).max() for part in data)
    effect = effect.with_shape((level * highest,))
    columns = [part.columns(bench.arm, effect)[:, :, :1] for part in data]
    problem = make_problem(data, noise, [part.residual(bench.arm) for part in data], columns)
    candidate = Candidate(effect, slice(0, 1), (0,), bench.robot)
    (trial,), _ = held_out(problem, (), [candidate], NormalEquations.none(0))
    evidence = Evidence.over_noise(data, noise)
    nuisance = Nuisance((), NormalEquations.none(0))
    work = Workspace(bench.arm, data)
    here = SearchState(evidence, work, DiagnosisSettings(), problem, nuisance, 1.0)
    return trial, without_echo(trial, here)


def beyond(tau, level, lost):
    """Return what a drive reports of torque that it does not give, (N, n) [N m]."""
    highest = level * np.abs(tau).max(axis=0)
    more = np.sign(tau) * np.maximum(np.abs(tau) - highest, 0.0)
    return lost / (1.0 - lost) * more * [0.0, 1.0]


def test_noise_of_the_torque_alone_loses_no_torque(bench):
    z = np.array([[one.z for one in tried(bench, seed)] for seed in range(12)])
    assert np.mean(z[:, 0]) > 2.0
    assert abs(np.mean(z[:, 1])) < 2.0 / np.sqrt(len(z)) + 0.5
    assert np.all(np.abs(z[:, 1]) < 3.5)


def test_torque_that_is_lost_stays_a_cause(bench):
    trial, without = tried(bench, seed=1, lost=0.5, loud=0.1)
    assert without.z > 10.0
    assert trial.values[0] == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize('name', CATALOGUE)
def test_what_has_an_echo_is_said_to_read_the_torque(bench, name):
    data = tuple(trajectories(bench.recordings(), USED))
    noise = [noise_floor(part, bench.arm).sigma for part in data]
    effect = CATALOGUE[name].on(bench.robot)
    highest = max(np.abs(bench.torque(part.motion)).max() for part in data)
    if effect.reads_torque:
        effect = effect.with_shape((0.5 * highest,))
    every = range(len(effect.parameters(bench.robot)))
    echo = Workspace(bench.arm, data).torque_echo(effect, every, noise)
    assert echo.any() == effect.reads_torque
