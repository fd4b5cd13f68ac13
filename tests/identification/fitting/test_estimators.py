# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every estimator finds the arm; instrumental variables are not biased by encoder noise."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import (
    IdentificationSettings,
    identify,
    PhysicalSettings,
    SignalSettings,
)
from armid_ros.identification.fitting.least_squares import ESTIMATORS
import numpy as np
import pytest

from ..conftest import multisine, recorded

SIGNALS = SignalSettings(20.0, 4)


@pytest.fixture(scope='module')
def motion(arm):
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
def test_every_estimator_predicts_torques_that_it_has_not_seen(arm, motion, method):
    assert torque_error(arm, motion, method, 0.05, 1e-5, SignalSettings()) < 0.02


def test_the_bias_of_encoder_noise_goes_away(arm, motion):
    plain, unbiased = (torque_error(arm, motion, m, 0.05, 3e-4) for m in ('wls', 'iv'))
    assert plain > 0.02
    assert unbiased < 0.4 * plain


@pytest.mark.long
def test_intervals_hold_the_truth(arm, motion):
    off = []
    for seed in range(3):
        recording = recorded(arm, motion, seed, 0.05, 3e-4)
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
