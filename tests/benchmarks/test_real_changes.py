# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of two days of real machines are read as their authors describe them."""

import numpy as np
import pytest

from benchmarks.real_changes import DAYS

pytestmark = [pytest.mark.real_data, pytest.mark.slow]


@pytest.mark.parametrize('name', DAYS)
def test_every_question_has_recordings_of_two_days(name, real_data, tmp_path):
    days = DAYS[name](real_data, tmp_path)
    assert days.day_1
    assert days.day_2
    for recording in (*days.day_1, *days.day_2, *days.held_out):
        assert recording.joints == days.robot.joints
        assert recording.t[0] == 0.0
        assert np.all(np.diff(recording.t) > 0.0)
        assert np.all(np.isfinite(recording.tau))
        assert recording.t[-1] > 3.0
