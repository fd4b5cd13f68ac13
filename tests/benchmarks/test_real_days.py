# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of two days of real machines are read as their authors describe them."""

import numpy as np
import pytest

from benchmarks.real_days import DAYS, pushes

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


def test_pushes_are_in_what_was_measured_and_not_in_what_was_commanded(real_data, tmp_path):
    commanded = pushes(real_data, tmp_path)
    measured = pushes(real_data, tmp_path, 'tau_meas')
    assert commanded.push is not None
    assert measured.push is None
    outside = measured.day_2[0].tau - commanded.day_2[0].tau
    for joint in range(2):
        push = commanded.push[:, joint]
        assert 0.2 < np.abs(push).max() < 0.8
        assert np.corrcoef(push, outside[:, joint])[0, 1] > 0.4
