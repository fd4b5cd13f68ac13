# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The instruments show what is asked of them: steps, noise of a colour, stamps that are off."""

import numpy as np
import pytest
from scipy.signal import welch

from tests.hidden.arrays import Signals
from tests.hidden.sensors import Sensors

RATE = 200.0


def still(n=2, seconds=200.0):
    """Return an arm that stands still and feels nothing."""
    t = np.arange(round(seconds * 1000)) * 1e-3
    zero = np.zeros((len(t), n))
    return Signals(t, zero + 0.3, zero, zero, zero, zero)


@pytest.fixture
def sensors():
    """Noise of 0.5 and 0.1 N m, 10 ms."""
    return Sensors(RATE, 1e-4, 2e-5, np.array([0.5, 0.1]), 0.01, 0.0)


def test_torque_noise_has_its_size_and_colour(sensors):
    recording = sensors.record(still(), ('a', 'b'), np.random.default_rng(0))
    np.testing.assert_allclose(recording.tau.std(axis=0), [0.5, 0.1], rtol=0.03)
    frequency, density = welch(recording.tau[:, 0], RATE, nperseg=512)
    low = density[(frequency > 1.0) & (frequency < 5.0)].mean()
    high = density[frequency > 80.0].mean()
    decay = np.exp(-1.0 / (RATE * 0.01))  # half white, half of first order
    expected = (0.5 + 0.5 * (1 + decay) / (1 - decay)) / (0.5 + 0.5 * (1 - decay) / (1 + decay))
    assert low / high == pytest.approx(expected, rel=0.15)


def test_positions_are_whole_steps_around_the_truth(sensors):
    recording = sensors.record(still(), ('a', 'b'), np.random.default_rng(1))
    steps = recording.q / 1e-4
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    assert abs(recording.q.mean() - 0.3) < 5e-5


def test_jitter_makes_a_moving_joint_noisy():
    ramp = still()
    q = ramp.q + 2.0 * ramp.t[:, np.newaxis]
    moving = Signals(ramp.t, q, ramp.dq, ramp.ddq, ramp.tau, ramp.command)
    sensors = Sensors(RATE, 1e-9, 0.0, np.zeros(2), 0.01, 2e-4)
    recording = sensors.record(moving, ('a', 'b'), np.random.default_rng(2))
    error = recording.q[1:-1] - (0.3 + 2.0 * recording.t[1:-1, np.newaxis])
    assert error.std() == pytest.approx(2.0 * 2e-4, rel=0.05)
