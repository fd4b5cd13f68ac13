# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Torque that a driver has filtered is told by its noise, and by how much."""

from __future__ import annotations

from armid_ros.inspection.band import LEAST, noise_band, standing_bands
import numpy as np
import pytest
from scipy.signal import butter, lfilter

RATE = 500.0


def filtered(noise, kind, band):
    if kind == 'smoothing':
        c = 2.0 - np.cos(2.0 * np.pi * band / RATE)
        keep = c - np.sqrt(c**2 - 1.0)
        return lfilter([1.0 - keep], [1.0, -keep], noise, axis=0)
    return lfilter(*butter(2, band, fs=RATE), noise, axis=0)


@pytest.mark.parametrize('kind', ['smoothing', 'butterworth'])
@pytest.mark.parametrize('band', [10.0, 30.0, 80.0])
def test_the_band_of_a_filter_is_found(kind, band):
    noise = np.random.default_rng(1).normal(size=(3000, 8))
    found = noise_band(filtered(noise, kind, band)[100:], RATE)
    np.testing.assert_allclose(found, band, rtol=0.35)


def test_white_noise_is_never_said_to_be_filtered():
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(size=(LEAST + 200 * seed, 8))
        assert np.isnan(noise_band(noise, RATE)).all()


def test_steps_of_a_converter_are_no_filter():
    noise = np.random.default_rng(2).normal(size=(4000, 4))
    assert np.isnan(noise_band(np.round(noise), RATE)).all()
    assert np.isnan(noise_band(np.zeros((4000, 4)), RATE)).all()


def test_only_where_the_arm_stands_is_looked_at():
    rng = np.random.default_rng(3)
    t = np.arange(8000) / RATE
    moving = (t > 4.0) & (t < 12.0)
    q = np.where(moving, np.sin(2.0 * np.pi * 0.5 * (t - 4.0)), 0.0)[:, np.newaxis]
    friction = np.sign(np.gradient(q, axis=0))  # falls off as a filter does, and is none
    tau = 10.0 * q + friction
    white = tau + rng.normal(size=tau.shape)
    assert np.isnan(standing_bands(q, white, 1.0 / RATE)).all()
    smooth = tau + filtered(rng.normal(size=tau.shape), 'smoothing', 20.0)
    found = standing_bands(q, smooth, 1.0 / RATE)
    np.testing.assert_allclose(found, 20.0, rtol=0.35)
    short = slice(2500, 5500)
    assert np.isnan(standing_bands(q[short], smooth[short], 1.0 / RATE)).all()
