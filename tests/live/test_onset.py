# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The residual of a model tells when an arm became another one."""

from __future__ import annotations

from armid_ros.identification.online.onset import onset


def test_nothing_is_found_where_nothing_changes(known_arm, healthy):
    assert onset(known_arm, healthy) is None


def test_what_came_before_a_change_is_left_out_and_the_change_itself(known_arm, changed):
    """However long ago it was: a window is seldom cut where blocks begin."""
    for end in (8.6, 9.3, 12.2, 17.9):
        assert onset(known_arm, changed.select(changed.t < end)) >= 8.0
    assert onset(known_arm, changed) < 9.0
