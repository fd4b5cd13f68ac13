# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Stamps that come late by more than a period each are told from samples that are lost."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import grade, IdentificationSettings, identify
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.identification.rows.stamps import two_senders, uneven_stamps
from armid_ros.recording import Recording
import numpy as np
import pytest

from ..conftest import multisine, recorded

RATE = 200.0
CUTOFF = 9.0


@pytest.fixture(scope='module')
def run(arm):
    motion = multisine(arm.robot.joints, 16.0, RATE, seed=1, base_hz=0.12)
    return recorded(arm, motion, torque_noise=0.02, source='run')


def jittered(run, by):
    noise = np.random.default_rng(1).uniform(-by, by, len(run))
    return replace(run, t=np.sort(run.t + noise))


def test_stamps_off_by_more_than_a_period_are_uneven(run):
    """Lost samples, small jitter and a slewed clock are not."""
    lossy = run.select(np.random.default_rng(1).random(len(run)) > 0.2)
    slewed = replace(run, t=run.t + 2e-4 * run.t**2)
    assert 'uneven' in uneven_stamps(jittered(run, 0.02), CUTOFF)
    for one in (run, lossy, jittered(run, 0.001), slewed):
        assert uneven_stamps(one, CUTOFF) == ''


def test_identification_says_it_where_too_little_is_left(structure, run):
    few = IdentificationSettings(signals=SignalSettings(CUTOFF, decimation=60))
    short = jittered(run, 0.02).select(slice(0, 1000))
    with pytest.raises(IdentificationError, match='uneven'):
        identify(structure, [short], few, rng=np.random.default_rng(0))


def test_a_grade_says_it_where_enough_is_left(structure, run):
    late = jittered(run, 0.009)
    fitted = identify(structure, [late], rng=np.random.default_rng(0))
    found = grade(fitted, structure, [late], {})
    assert found.word != 'good'
    assert any('uneven' in one for one in found.reasons)


JOINTS = ('shoulder', 'elbow', 'wrist')


def sent(seed=1, rate=100.0, amplitude=0.5, noise=1e-5, step=0.0):
    motion = multisine(JOINTS, 40.0, rate, seed, amplitude)
    q = motion.q + noise * np.random.default_rng(seed).normal(size=motion.q.shape)
    q = np.round(q / step) * step if step else q
    return Recording(joints=JOINTS, t=motion.t, q=q, tau=3.0 * motion.q)


def mixed(one, other, later):
    """Put the messages of two recordings into one, in order of time."""
    t = np.concatenate([one.t, other.t + later])
    order = np.argsort(t, kind='stable')
    q, tau = (
        np.concatenate([getattr(one, name), getattr(other, name)])[order] for name in ('q', 'tau')
    )
    return Recording(joints=JOINTS, t=t[order], q=q, tau=tau, source='mixed')


def zeros_of_another(one, count=200):
    t = np.sort(np.random.default_rng(0).uniform(0.0, one.t[-1], count))
    nothing = np.zeros((count, len(JOINTS)))
    return mixed(one, Recording(joints=JOINTS, t=t, q=nothing, tau=nothing), 0.0)


def leader_and_follower(one):
    lag = np.column_stack([np.interp(one.t - 0.05, one.t, column) for column in one.q.T])
    return mixed(one, replace(one, q=lag), 0.003)


def two_arms(one):
    return mixed(one, sent(2), 0.0003)


@pytest.mark.parametrize('mix', [zeros_of_another, leader_and_follower, two_arms])
def test_two_senders_of_one_topic_are_refused(mix):
    with pytest.raises(IdentificationError, match='two senders'):
        conditioning([mix(sent())], SignalSettings())


def with_faulty_samples(value):
    def spoil(one):
        rng, q = np.random.default_rng(0), one.q.copy()
        rows = rng.choice(len(q), 200, replace=False)
        q[rows] = value(rng, (200, len(JOINTS)))
        return replace(one, q=q)

    return spoil


@pytest.mark.parametrize(
    'sound',
    [
        sent(),
        sent(noise=1e-2),
        sent(step=5e-3),
        sent(amplitude=1e-3, noise=2e-3),
        sent(rate=20.0),
        sent(rate=1000.0, noise=5e-3),
        with_faulty_samples(lambda rng, shape: np.zeros(shape))(sent()),
        with_faulty_samples(lambda rng, shape: rng.normal(size=shape))(sent()),
    ],
)
def test_one_sender_is_one(sound):
    assert two_senders(sound) == ''
