# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What sensors add, that they add exactly that, and temperatures of joints."""

from armid_ros.errors import ModelError
from armid_ros.simulation import Sensors
from armid_ros.simulation.warm_up import temperature_course
import numpy as np
import pytest
from scipy.stats import chi2

N = 20_000
ZERO = np.zeros((N, 2))


def test_noise_has_the_standard_deviation_asked_for_and_is_white() -> None:
    stds = {'position': [1e-4, 2e-4], 'velocity': [0.01, 0.02], 'torque': [0.5, 1.5]}
    sensors = Sensors(
        position_noise=np.array(stds['position']),
        velocity_noise=np.array(stds['velocity']),
        torque_noise=np.array(stds['torque']),
    )
    readings = sensors.measure(ZERO, ZERO, ZERO, np.random.default_rng(1))
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], N)
    for reading, std in zip(readings, stds.values(), strict=True):
        squares = np.sum((reading / np.array(std)) ** 2, axis=0)
        assert np.all((low < squares) & (squares < high))
        correlation = np.mean(reading[1:] * reading[:-1], axis=0) / np.array(std) ** 2
        assert np.all(np.abs(correlation) < 4.0 / np.sqrt(N))
    across = np.corrcoef(np.column_stack(readings).T) - np.eye(6)
    assert np.abs(across).max() < 4.5 / np.sqrt(N)


def test_an_encoder_reads_whole_steps_within_half_a_step_of_the_truth() -> None:
    q = np.linspace(-1.0, 1.0, N)[:, np.newaxis] * np.array([1.0, 1.0])
    resolution = np.array([2.0 * np.pi / 4096, 0.0])
    read, _, _ = Sensors(resolution=resolution).measure(q, q, q, np.random.default_rng(0))
    steps = read[:, 0] / resolution[0]
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    error = read[:, 0] - q[:, 0]
    assert np.abs(error).max() <= resolution[0] / 2 * (1.0 + 1e-9)
    assert error.std() == pytest.approx(resolution[0] / np.sqrt(12.0), rel=0.01)
    np.testing.assert_array_equal(read[:, 1], q[:, 1])


def test_nonsense_is_refused() -> None:
    with pytest.raises(ModelError, match='torque_noise'):
        Sensors(torque_noise=-0.1)
    with pytest.raises(ModelError, match='steps'):
        Sensors(torque_delay=-1)


def test_joints_warm_up_with_a_time_constant_or_stay_as_they_are():
    course = temperature_course('20:45:600,30', 2, 600.0)
    warm = 45.0 - 25.0 * np.exp(-1.0)
    np.testing.assert_allclose(course.at([0.0, 600.0]), [[20.0, 30.0], [warm, 30.0]])


@pytest.mark.parametrize('text', ['hot', '20:45', '20,30,40', '20:45:600:1', ''])
def test_other_texts_are_refused(text):
    with pytest.raises(ModelError, match='write 25, or 20:45:600'):
        temperature_course(text, 2, 10.0)
