# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import IdentificationSettings, identify
from armid_ros.identification.rows.period import find_period, is_same_path
from armid_ros.identification.rows.signals import (
    Conditioning,
    conditioning,
    decimate,
    decimated_samples,
    segments,
    SignalSettings,
    velocity_error,
)
from armid_ros.recording import Recording
import numpy as np
import pytest

from ..conftest import multisine, recorded


@pytest.mark.parametrize(
    ('rate', 'jitter', 'decimation'), [(1000.0, 0.0, 10), (500.0, 0.3, 5), (200.0, 0.0, 10)]
)
def test_derivatives_of_a_sine_have_no_phase(rate, jitter, decimation):
    """With stamps up to 0.3 periods early or late, and at another rate than that of the filter."""
    t = np.arange(round(10.0 * rate)) / rate
    t = t + jitter / rate * np.random.default_rng(1).uniform(-1.0, 1.0, len(t))
    q, w = np.sin(2.0 * np.pi * t)[:, None], 2.0 * np.pi
    recording = Recording(joints=('a',), t=t, q=q, tau=q, source='bag')
    used = Conditioning(max(rate, 500.0), 50.0, decimation)
    (whole,) = segments(recording, used)
    motion = whole.select(slice(100, -100))
    np.testing.assert_allclose(motion.dq[:, 0], w * np.cos(w * motion.t), atol=1e-3 * w)
    if not jitter:
        np.testing.assert_allclose(
            motion.ddq[:, 0], -w * w * np.sin(w * motion.t), atol=1e-3 * w * w
        )


def test_decimation_passes_the_band_and_stops_what_would_alias():
    used = Conditioning(1000.0, 50.0, 20)
    t = np.arange(10_000) / 1000.0
    slow, fast = (np.sin(2.0 * np.pi * hz * t)[:, None] for hz in (2.0, 47.0))
    kept = np.array(decimated_samples(len(t), used))
    np.testing.assert_allclose(decimate(slow, used), slow[kept], atol=3e-3)
    assert np.abs(decimate(fast, used)).max() < 5e-3  # would alias to 3 Hz


def test_what_is_across_a_gap_is_no_motion(arm):
    motion = multisine(arm.robot.joints, 40.0, 1000.0, seed=2)
    whole = recorded(arm, motion, position_noise=1e-6)
    cut = whole.select((whole.t < 20.0) | (whole.t > 22.0))
    used = conditioning([whole], SignalSettings())
    before, after = segments(cut, used)
    assert before.t[-1] < 20.0 < 22.0 < after.t[0]
    assert conditioning([cut], SignalSettings()).decimation > 0.5 * used.decimation
    assert np.all(velocity_error(cut, used) < 2.0 * velocity_error(whole, used))


def test_cutoff_is_where_positions_meet_their_noise(arm):
    motion = multisine(arm.robot.joints, 40.0, 1000.0, seed=2)
    quiet = conditioning([recorded(arm, motion, position_noise=1e-6)], SignalSettings())
    noisy = conditioning([recorded(arm, motion, position_noise=1e-3)], SignalSettings())
    assert noisy.cutoff_hz < quiet.cutoff_hz <= 200.0
    assert noisy.cutoff_hz >= 0.5  # the fastest harmonic
    assert noisy.decimation == quiet.decimation


@pytest.mark.parametrize('rate', [50.0, 200.0, 1000.0, 2000.0])
def test_a_row_takes_less_than_twenty_smooth_samples_at_any_rate(arm, rate):
    motion = multisine(arm.robot.joints, 20.0, rate, seed=2)
    used = conditioning([recorded(arm, motion, position_noise=1e-9)], SignalSettings())
    assert used.decimation % used.smooth_stride == 0
    assert used.decimation < 20 * used.smooth_stride


@pytest.mark.parametrize('cutoff', [10.0, 40.0])
def test_noise_of_velocities_is_what_white_noise_of_positions_makes(cutoff):
    rng = np.random.default_rng(0)
    t = np.arange(20_000) / 500.0
    q = np.array([1e-4, 3e-3]) * rng.normal(size=(len(t), 2))
    recording = Recording(joints=('a', 'b'), t=t, q=q, tau=q, source='bag')
    used = Conditioning(500.0, cutoff, 5)
    (motion,) = segments(recording, used)
    np.testing.assert_allclose(velocity_error(recording, used), motion.dq.std(axis=0), rtol=0.15)


def test_velocities_lack_what_positions_show_beyond_the_cutoff():
    t = np.arange(20_000) / 500.0
    fast = 0.02 * np.sin(2.0 * np.pi * 12.0 * t)
    q = (np.sin(2.0 * np.pi * t) + fast)[:, None]
    q = q + 1e-6 * np.random.default_rng(0).normal(size=q.shape)
    recording = Recording(joints=('a',), t=t, q=q, tau=q, source='bag')
    lacking = 2.0 * np.pi * 12.0 * fast.std()
    below, above = (velocity_error(recording, Conditioning(500.0, hz, 5)) for hz in (4.0, 30.0))
    np.testing.assert_allclose(below, lacking, rtol=0.05)
    assert above < 0.01 * lacking


@pytest.mark.parametrize(
    ('time', 'cutoff_hz', 'fact'),
    [
        (1.0, 300.0, '600 samples/s'),
        (1e3, None, 'run: .*milliseconds'),
        (1e6, None, 'run: .*microseconds'),
        (1.0, 0.001, 'run: --cutoff'),
    ],
)
def test_a_cutoff_or_stamps_that_cannot_be_are_refused(arm, structure, time, cutoff_hz, fact):
    motion = multisine(arm.robot.joints, 2.0, 500.0, seed=1)
    run = recorded(arm, motion, torque_noise=0.01, source='run')
    settings = IdentificationSettings(signals=SignalSettings(cutoff_hz=cutoff_hz))
    with pytest.raises(IdentificationError, match=fact):
        identify(structure, [replace(run, t=time * run.t)], settings, rng=np.random.default_rng(0))


def test_slow_motion_is_like_itself_a_while_later_and_repeats_nothing():
    """In the shortest period a crawl goes less than two positions may differ by."""
    crawl = np.linspace(0.0, 0.1, 1200)
    there = 0.1 + 0.9 * 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, 300)))
    q = np.concatenate([crawl, there])
    assert find_period(np.arange(len(q)) / 100.0, np.column_stack([q, -0.5 * q])) is None


def test_a_path_is_the_same_after_a_shift_in_time_and_with_noise_but_not_in_another_motion():
    rng = np.random.default_rng(0)
    t = np.arange(1000) / 50.0
    first, other = (
        np.sin(t[:, np.newaxis] * rng.uniform(1.0, 3.0, 4) + rng.uniform(0.0, 6.0, 4))
        for _ in range(2)
    )
    repeated = first[60:] + 0.005 * rng.normal(size=first[60:].shape)
    assert is_same_path(first, repeated) and is_same_path(repeated, first)
    assert not is_same_path(first, other)
    assert not is_same_path(first, first[600:])  # a short part of it
