# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The residual of a model tells when an arm became another one."""

from __future__ import annotations

from armid_ros.live.onset import onset


def test_the_time_of_a_change_is_found_within_a_second(known_arm, changed):
    assert abs(onset(known_arm, changed) - 8.0) < 1.0


def test_nothing_is_found_where_nothing_changes(known_arm, healthy):
    assert onset(known_arm, healthy) is None
