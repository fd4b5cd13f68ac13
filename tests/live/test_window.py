# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The window keeps the latest motion in memory that does not grow."""

from armid_ros.nodes.live import SampleWindow
import numpy as np

JOINTS = ('a', 'b')


def filled(rate, duration, window=None):
    window = window or SampleWindow(JOINTS, 2.0, 0.01)
    for t in np.arange(0.0, duration, 1.0 / rate):
        window.add(t, np.array([np.sin(t), 0.0]), np.zeros(2), np.array([t, -t]))
    return window


def test_streams_of_any_rate_are_kept_at_the_rate_of_the_window():
    for rate in (100.0, 333.0, 1000.0):
        kept = filled(rate, 5.0).recording()
        assert np.diff(kept.t).min() >= 0.0075
        assert kept.duration >= 1.98


def test_the_latest_samples_are_kept_as_they_came():
    kept = filled(100.0, 5.0).recording()
    np.testing.assert_allclose(kept.tau[:, 0], kept.t + kept.tau[0, 0], atol=1e-12)
    np.testing.assert_allclose(kept.q[:, 0], np.sin(kept.tau[:, 0]))
    assert kept.tau[-1, 0] > 4.98


def test_a_gap_and_a_jump_back_begin_a_window_anew():
    for t in (5.0, 1.0):
        window = filled(100.0, 2.0)
        window.add(t, np.zeros(2), np.zeros(2), np.zeros(2))
        assert len(window) == 1


def test_a_sample_that_comes_late_or_twice_is_left_out():
    """As of two publishers of the same joint states."""
    window, kept = SampleWindow(JOINTS, 2.0, 0.01), 0
    for t in np.arange(0.0, 1.5, 0.01):
        kept += window.add(t, np.zeros(2), np.zeros(2), np.zeros(2))
        for again in (t, t - 0.015):
            assert not window.add(again, np.ones(2), np.ones(2), np.ones(2))
    assert len(window) == kept
    assert not window.recording().q.any()


def test_rest_is_no_motion():
    window = SampleWindow(JOINTS, 2.0, 0.01)
    for t in np.arange(0.0, 3.0, 0.01):
        window.add(t, np.array([max(t - 2.0, 0.0), 0.0]), None, np.zeros(2))
    assert abs(window.moved - 1.0) < 0.03
    assert window.recording().dq is None
