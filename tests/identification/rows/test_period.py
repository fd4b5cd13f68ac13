# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A motion repeats itself where it goes the same way again, and not where it hardly goes."""

from armid_ros.identification.rows.period import find_period
import numpy as np
import pytest

RATE = 100.0


def motion(q):
    """Return times and positions of two joints, both the same but for their sizes."""
    return np.arange(len(q)) / RATE, np.column_stack([q, -0.5 * q])


def test_a_period_that_comes_twice_is_found():
    t = np.arange(1000) / RATE
    lag, where = find_period(*motion(np.sin(2 * np.pi * t / 5.0) + 0.3 * np.sin(2 * np.pi * t)))
    assert lag == 500
    assert (where.start, where.stop) == (0, 500)


def test_slow_motion_is_like_itself_a_while_later_and_repeats_nothing():
    """In the shortest period a crawl goes less than two positions may differ by."""
    crawl = np.linspace(0.0, 0.1, 1200)
    there = 0.1 + 0.9 * 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, 300)))
    assert find_period(*motion(np.concatenate([crawl, there]))) is None


def test_two_slow_periods_are_found_all_the_same():
    t = np.arange(6000) / RATE
    lag, _ = find_period(
        *motion(np.sin(2 * np.pi * t / 30.0) + 0.4 * np.sin(2 * np.pi * t / 10.0))
    )
    assert lag == pytest.approx(3000, abs=8)
