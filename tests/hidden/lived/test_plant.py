# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Dry friction turns as Dahl says, and the low-pass of a drive lags by its time constant."""

import numpy as np
import pytest

from tests.hidden.arrays import low_pass
from tests.hidden.lived.wear import bristle


def test_the_bristle_is_dahl_between_any_samples():
    rng = np.random.default_rng(4)
    q = np.cumsum(rng.normal(size=(400, 1)), axis=0) * 1e-3
    q[100:150] = q[100]
    state, distance = 0.0, 2e-3
    for k, way in enumerate(np.diff(q[:, 0])):
        target = np.sign(way)
        if way:
            state = target + (state - target) * np.exp(-abs(way) / distance)
        assert bristle(q, np.array([distance]))[k + 1, 0] == pytest.approx(state, abs=1e-12)


def test_the_low_pass_lags_a_ramp_by_its_time_constant():
    t = np.arange(2000) * 1e-3
    lagged = low_pass(3.0 * t[:, np.newaxis], 0.004, 1e-3)
    np.testing.assert_allclose(lagged[200:, 0], 3.0 * (t[200:] - 0.004), atol=1e-9)
