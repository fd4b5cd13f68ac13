# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How long a motion takes to repeat is said alike, at whatever rate it was found."""

from armid_ros.identification.rows.period import exact_period
from armid_ros.inspection.sampling import Sampling
from armid_ros.recording import Recording
import numpy as np
import pytest


def repeating(period, rate=200.0, duration=20.0):
    """Return a recording of three harmonics in two joints, and one that rests."""
    t = np.arange(round(duration * rate)) / rate
    angle = 2.0 * np.pi * t[:, np.newaxis] / period
    q = np.sin(angle + np.array([0.0, 1.0])) + 0.4 * np.sin(3 * angle + np.array([2.0, 0.5]))
    return Recording(joints=('a', 'b', 'c'), t=t, q=np.column_stack([q, np.zeros(len(t))]))


@pytest.mark.parametrize('period', [6.0, 7.973, 8.0])
@pytest.mark.parametrize('off', [-0.05, 0.0, 0.03])
def test_a_period_is_no_multiple_of_the_step_that_it_was_found_with(period, off):
    assert exact_period(repeating(period), period + off) == pytest.approx(period, abs=1e-3)


@pytest.mark.parametrize('period', [6.0, 7.973, 8.0])
def test_an_inspection_says_the_same(period):
    recording = repeating(period)
    found = Sampling.of(recording).period
    assert found == pytest.approx(exact_period(recording, period + 0.04), abs=1e-9)


def test_what_does_not_repeat_near_there_stays_as_it_was_found():
    recording = repeating(6.0)
    assert exact_period(recording, 7.2) == 7.2
    assert exact_period(recording.select(slice(0, 300)), 6.0) == 6.0
