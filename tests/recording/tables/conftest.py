# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A motion of two joints, for files of every format."""

import numpy as np
import pytest

JOINTS = ('shoulder', 'elbow')


@pytest.fixture
def motion():
    """Return time and positions, velocities and torques, shapes (N,) and (N, 2)."""
    t = np.arange(200) * 0.005
    w = 2 * np.pi * np.array([1.0, 1.7])
    q, dq = 0.4 * np.sin(t[:, None] * w), 0.4 * w * np.cos(t[:, None] * w)
    return t, q, dq, 3.0 * q + 0.2 * dq


def assert_holds(recording, motion, velocity=True):
    """Check that a recording equals the motion."""
    t, q, dq, tau = motion
    np.testing.assert_allclose(recording.t, t - t[0], atol=1e-6)
    np.testing.assert_allclose(recording.q, q, atol=1e-6)
    np.testing.assert_allclose(recording.tau, tau, atol=1e-6)
    if velocity:
        np.testing.assert_allclose(recording.dq, dq, atol=1e-6)
