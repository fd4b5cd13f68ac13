# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A motion repeats itself where it goes the same way again, and not where it hardly goes."""

from armid_ros.identification.rows.period import find_period
import numpy as np


def test_slow_motion_is_like_itself_a_while_later_and_repeats_nothing():
    """In the shortest period a crawl goes less than two positions may differ by."""
    crawl = np.linspace(0.0, 0.1, 1200)
    there = 0.1 + 0.9 * 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, 300)))
    q = np.concatenate([crawl, there])
    assert find_period(np.arange(len(q)) / 100.0, np.column_stack([q, -0.5 * q])) is None
