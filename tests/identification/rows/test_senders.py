# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Two senders of one topic are refused; noise, coarse encoders and faulty samples are not."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.identification.rows.stamps import two_senders
from armid_ros.recording import Recording
import numpy as np
import pytest

from ..conftest import multisine

JOINTS = ('shoulder', 'elbow', 'wrist')


def run(seed=1, rate=100.0, amplitude=0.5, noise=1e-5, step=0.0):
    motion = multisine(JOINTS, 40.0, rate, seed, amplitude)
    q = motion.q + noise * np.random.default_rng(seed).normal(size=motion.q.shape)
    q = np.round(q / step) * step if step else q
    return Recording(joints=JOINTS, t=motion.t, q=q, dq=motion.dq, tau=3.0 * motion.q)


def mixed(one, other, later):
    """Put the messages of two recordings into one, in order of time."""
    t = np.concatenate([one.t, other.t + later])
    order = np.argsort(t, kind='stable')
    q, dq, tau = (
        np.concatenate([getattr(one, name), getattr(other, name)])[order]
        for name in ('q', 'dq', 'tau')
    )
    return Recording(joints=JOINTS, t=t[order], q=q, dq=dq, tau=tau, source='mixed')


def zeros_of_another(one, count=200):
    t = np.sort(np.random.default_rng(0).uniform(0.0, one.t[-1], count))
    nothing = np.zeros((count, len(JOINTS)))
    return mixed(one, Recording(joints=JOINTS, t=t, q=nothing, dq=nothing, tau=nothing), 0.0)


def leader_and_follower(one):
    lag = np.column_stack([np.interp(one.t - 0.05, one.t, column) for column in one.q.T])
    return mixed(one, replace(one, q=lag), 0.003)


def two_arms(one):
    return mixed(one, run(2), 0.0003)


@pytest.mark.parametrize('velocity', [True, False])
@pytest.mark.parametrize('mix', [zeros_of_another, leader_and_follower, two_arms])
def test_two_senders_of_one_topic_are_refused(mix, velocity):
    recording = mix(run())
    recording = recording if velocity else replace(recording, dq=None)
    with pytest.raises(IdentificationError, match='two senders'):
        conditioning([recording], SignalSettings())


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
        run(),
        run(noise=1e-2),
        run(step=5e-3),
        run(amplitude=1e-3, noise=2e-3),
        run(rate=20.0),
        run(rate=1000.0, noise=5e-3),
        with_faulty_samples(lambda rng, shape: np.zeros(shape))(run()),
        with_faulty_samples(lambda rng, shape: rng.normal(size=shape))(run()),
    ],
)
@pytest.mark.parametrize('velocity', [True, False])
def test_one_sender_is_one(sound, velocity):
    assert two_senders(sound if velocity else replace(sound, dq=None)) == ''
