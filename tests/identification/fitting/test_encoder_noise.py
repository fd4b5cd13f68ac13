# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every estimator finds the arm; encoder noise that biases it is found and sized."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import (
    IdentificationSettings,
    identify,
    PhysicalSettings,
    SignalSettings,
)
from armid_ros.identification.fitting.instruments import check_noise, position_noise
from armid_ros.identification.fitting.least_squares import ESTIMATORS
from armid_ros.identification.fitting.nonlinear import linearised
import numpy as np
import pytest

from ..conftest import multisine, recorded

SETTINGS = IdentificationSettings(signals=SignalSettings(20.0, 4))


@pytest.fixture(scope='module')
def motion(arm):
    return multisine(arm.robot.joints, 15.0, 200.0, seed=1)


@pytest.fixture(scope='module')
def biased(arm, structure, motion):
    """Return a fit to data with encoder noise alone, and the check of its noise."""
    return checked(arm, structure, motion, 0.0, 3e-4)


def checked(arm, structure, motion, torque_noise, position_noise, seed=0):
    recording = recorded(arm, motion, seed, torque_noise, position_noise)
    result = identify(structure, [recording], SETTINGS, rng=np.random.default_rng(0))
    return result, noise_check(result, recording, seed, 3)


def noise_check(result, recording, seed, repeats):
    def problem_of(some):
        return linearised(result.arm, result.base, some, result.used)[0]

    fitted = result.estimate, result.settings.least_squares, [recording], result.used
    return check_noise(problem_of, *fitted, rng=np.random.default_rng(seed), repeats=repeats)


def test_without_encoder_noise_the_test_finds_nothing(arm, structure, motion):
    p_values = [checked(arm, structure, motion, 0.05, 0.0, seed)[1].p_value for seed in range(4)]
    assert np.median(p_values) > 0.1
    assert min(p_values) > 1e-3


def test_encoder_noise_that_matters_is_found_and_sized(arm, structure, motion):
    _, check = checked(arm, structure, motion, 0.05, 3e-4)
    assert not check.consistent
    assert check.p_value < 1e-6
    np.testing.assert_allclose(check.position_noise, 3e-4, rtol=0.1)
    assert np.abs(check.relative_bias).max() > 1.0


@pytest.mark.parametrize(
    ('p_value', 'bias', 'lacking', 'fine'),
    [
        (0.5, 0.01, False, (True, True)),
        (1e-9, 2.0, False, (False, False)),
        (1e-9, 0.01, True, (False, True)),
    ],
)
def test_a_test_that_fires_without_a_bias_shows_a_lacking_effect(
    biased, p_value, bias, lacking, fine
):
    _, check = biased
    check = replace(check, p_value=p_value, bias=bias * check.std)
    findings = check.findings()
    assert ('model lacks' in findings[0][0]) == lacking
    assert tuple(right for _, right in findings) == fine


def test_simulated_bias_is_the_error_of_a_fit_without_torque_noise(arm, biased):
    result, check = biased
    error = result.estimate.values - result.base.values(arm.theta)
    large = np.abs(check.bias) > 5.0 * check.bias_std
    large &= np.abs(error) > 0.5 * result.estimate.std
    assert large.sum() >= 5
    assert 0.75 < np.median(check.bias[large] / error[large]) < 1.35


@pytest.mark.parametrize('lost', [slice(800, 1400), [500, 900, 1500]])
def test_samples_that_are_missing_are_no_noise_of_encoders(arm, structure, motion, lost):
    """What the arm does meanwhile is a jump from one sample to the next."""
    whole = recorded(arm, motion, 0, 0.05, 3e-6)
    recording = whole.select(np.delete(np.arange(len(whole)), lost))
    np.testing.assert_allclose(position_noise(recording), position_noise(whole), rtol=0.2)
    result = identify(structure, [recording], SETTINGS, rng=np.random.default_rng(0))
    check = noise_check(result, recording, 0, 2)
    assert check.harmless, check.findings()


SIGNALS = SignalSettings(20.0, 4)


@pytest.fixture(scope='module')
def short(arm):
    return multisine(arm.robot.joints, 10.0, 200.0, seed=1)


def torque_error(arm, motion, method, torque_noise, position_noise, signals=SIGNALS, seed=0):
    """Return the error of the torque along a motion that was not used, as a share of it."""
    recording = recorded(arm, motion, seed, torque_noise, position_noise)
    found = identify(
        replace(arm, values=()),
        [recording],
        IdentificationSettings(method, signals),
        rng=np.random.default_rng(0),
    )
    other = multisine(arm.robot.joints, 5.0, 200.0, seed=2)
    tau = arm.torque(other)
    return np.linalg.norm(found.arm.torque(other) - tau) / np.linalg.norm(tau)


@pytest.mark.parametrize('method', ESTIMATORS)
def test_every_estimator_predicts_torques_that_it_has_not_seen(arm, short, method):
    assert torque_error(arm, short, method, 0.05, 1e-5, SignalSettings()) < 0.02


def test_the_bias_of_encoder_noise_goes_away(arm, short):
    plain, unbiased = (torque_error(arm, short, m, 0.05, 3e-4) for m in ('wls', 'iv'))
    assert plain > 0.02
    assert unbiased < 0.4 * plain


@pytest.mark.long
def test_intervals_hold_the_truth(arm, short):
    off = []
    for seed in range(3):
        recording = recorded(arm, short, seed, 0.05, 3e-4)
        found = identify(
            replace(arm, values=()),
            [recording],
            IdentificationSettings('iv', SIGNALS),
            rng=np.random.default_rng(0),
        )
        error = found.estimate.values - found.base.values(arm.theta)
        off.append(np.abs(error) / found.estimate.std)
    assert 0.85 < np.mean(np.array(off) < 1.96) <= 1.0
    assert np.max(off) < 5.0


def test_settings_that_no_estimator_has_are_refused():
    with pytest.raises(IdentificationError, match=r'iv\b.*irls'):
        IdentificationSettings('iv', physical=PhysicalSettings())
    with pytest.raises(IdentificationError, match=r'ekf.*wls'):
        IdentificationSettings('ekf')
