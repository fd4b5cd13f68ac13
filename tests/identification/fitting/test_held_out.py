# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Held-out data: the cut-off, halves that predict each other, and scatter of recordings."""

from dataclasses import replace

from armid_ros.identification.fitting import held_out
from armid_ros.identification.fitting.held_out import cutoff_of_torques, halves_error, jackknife
from armid_ros.identification.rows.regression import Regression
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.motion import Motion
import numpy as np
import pytest
from scipy import signal

from ..conftest import multisine, recorded


def recordings(arm, shake=0.0, duration=20.0):
    """Return motion whose positions shake at 8 to 15 Hz, which no torque makes [rad]."""
    made = []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        motion = multisine(arm.robot.joints, duration, 200.0, seed)
        recording = recorded(arm, motion, seed, torque_noise=0.02)
        band = signal.butter(2, (8.0, 15.0), 'band', fs=1.0 / recording.period, output='sos')
        slack = signal.sosfiltfilt(band, rng.normal(size=recording.q.shape), axis=0)
        made.append(replace(recording, q=recording.q + shake * slack / slack.std()))
    return made


def chosen(arm, data):
    """Return the cut-off that spectra ask for, and the one that torques ask for [Hz]."""
    used = conditioning(data, SignalSettings())
    columns = arm.base_parameters(np.random.default_rng(0)).independent
    return used.cutoff_hz, cutoff_of_torques(arm, columns, data, used).cutoff_hz


def test_clean_data_keep_the_cutoff_of_their_spectra(arm):
    spectra, torques = chosen(arm, recordings(arm))
    assert torques == spectra


def test_what_no_torque_makes_is_cut_off(arm):
    spectra, torques = chosen(arm, recordings(arm, shake=1e-3))
    assert spectra > 15.0
    assert torques < 15.0


def test_ends_that_are_cut_off_with_a_lower_cutoff_do_not_choose_it(arm):
    data = recordings(arm)
    loud = []
    for recording in data:
        rng = np.random.default_rng(0)
        ends = (recording.t < recording.t[0] + 1.5) | (recording.t > recording.t[-1] - 1.5)
        noise = rng.normal(size=recording.tau.shape) * np.std(recording.tau, axis=0)
        loud.append(replace(recording, tau=recording.tau + 0.5 * ends[:, None] * noise))
    spectra, torques = chosen(arm, loud)
    assert torques == spectra


def test_long_recordings_are_compared_on_a_part_with_the_same_answer(arm, monkeypatch):
    data = recordings(arm, 1e-3, 60.0)
    whole = chosen(arm, data)
    used = conditioning(data, SignalSettings())
    total = sum(len(recording) for recording in data)
    monkeypatch.setattr(held_out, '_MAX_ROWS', total // (4 * used.decimation))
    compared = []

    def counted(arm, columns, parts, lower):
        compared.append(sum(len(part) for part in parts))
        return regressions(arm, columns, parts, lower)

    regressions = held_out.regressions
    monkeypatch.setattr(held_out, 'regressions', counted)
    assert chosen(arm, data) == whole
    assert 8 * max(compared) <= 0.5 * total


def problem(columns, tau):
    still, joints = np.zeros(tau.shape), tuple('abc'[: tau.shape[1]])
    motion = Motion(joints, np.arange(len(tau)), still, still, still, tau)
    return [Regression('drawn', motion, np.ones(tau.shape, np.bool_), columns)]


def test_data_without_noise_that_cannot_tell_two_parameters_apart_predict_themselves():
    """Their residual is that of arithmetic alone, and no unit for anything."""
    rng = np.random.default_rng(0)
    one = rng.normal(size=(200, 2, 1))
    columns = np.concatenate([one, 2.0 * one], axis=2)
    tau = columns @ np.array([1.0, 2.0])
    weights = np.full(tau.shape, 1e12)
    assert halves_error(problem(columns, tau), weights, np.zeros(2)).relative_error_percent < 1e-6


def test_the_error_of_a_joint_is_a_share_of_its_own_torque():
    """Of noise: a slide that takes newtons hides nothing of a wrist that is not predicted."""
    rng = np.random.default_rng(0)
    columns = np.zeros((4000, 3, 3))
    columns[:, range(3), range(3)] = rng.normal(size=(4000, 3))
    noise = 0.1 * rng.normal(size=(4000, 3))
    tau = columns @ np.array([100.0, 0.0, 1.0]) + noise
    error = halves_error(problem(columns, tau), np.full(tau.shape, 10.0), np.zeros(3))
    assert error.relative_error_percent < 1.0
    expected = 100.0 * np.std(noise, axis=0) / np.std(tau, axis=0)
    assert error.joint_relative_error_percent == pytest.approx(expected, rel=0.05)


#: Of a recording, of which the scatter is asked.
LONG, NOISE = 80, 0.1


def recording(rng, values, source, columns=None):
    """Return rows of two joints that have values in one recording, with noise."""
    own = rng.normal(size=(LONG, 2, len(values))) if columns is None else columns
    tau = own @ np.asarray(values) + NOISE * rng.normal(size=(LONG, 2))
    still = np.zeros((LONG, 2))
    motion = Motion(('a', 'b'), np.arange(LONG), still, still, still, tau)
    return Regression(source, motion, np.ones(tau.shape, np.bool_), own)


def fitted(problem):
    """Return the scatter of a least-squares fit, and its standard deviations for noise."""
    rows = np.concatenate([part.columns.reshape(2 * LONG, -1) for part in problem])
    aim = np.concatenate([part.tau.ravel() for part in problem])
    values = np.linalg.lstsq(rows, aim, rcond=None)[0]
    weights = np.full((len(problem) * LONG, 2), 1.0 / NOISE)
    std = NOISE * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    return jackknife(problem, weights, values), std


def test_noise_alone_makes_the_variance_that_least_squares_have():
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(40):
        problem = [recording(rng, [1.0, -2.0, 0.5], f'{k}') for k in range(4)]
        found, std = fitted(problem)
        ratios.append(np.sum(found**2, axis=0) / std**2)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)


def test_values_that_differ_from_recording_to_recording_have_the_variance_of_their_mean():
    rng = np.random.default_rng(1)
    squares = []
    for _ in range(40):
        drawn = rng.normal(size=(4, 3))
        problem = [recording(rng, own, f'{k}') for k, own in enumerate(drawn)]
        squares.append(np.sum(fitted(problem)[0] ** 2, axis=0))
    assert np.mean(squares) == pytest.approx(0.25, rel=0.15)


def test_stretches_of_a_recording_are_one_and_what_one_recording_alone_shows_has_no_scatter():
    rng = np.random.default_rng(2)
    problem = [recording(rng, [1.0, 2.0], name) for name in ('one', 'two', 'one')]
    assert len(fitted(problem)[0]) == 2
    assert jackknife(problem[:1], np.ones((LONG, 2)), np.zeros(2)).shape == (0, 2)
    still = rng.normal(size=(LONG, 2, 2)) * [1.0, 0.0]
    others = [recording(rng, [3.0, 2.0], f'{k}', still) for k in range(2)]
    found, _ = fitted([problem[0], *others])
    assert np.all(found[1:, 0] != 0.0)
    np.testing.assert_array_equal(found[0, 1], 0.0)
