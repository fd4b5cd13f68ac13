# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording is the same as another one if the arm moved alike and took the same torques."""

from dataclasses import replace

from armid_ros.errors import RecordingError
from armid_ros.recording import given_twice, require_once
import pytest


@pytest.fixture
def monday(make_swing):
    return replace(make_swing(), source='monday')


def test_a_copy_is_said_with_what_it_is_a_copy_of(monday):
    copy = replace(monday, source='copy')
    for recordings in ([monday, copy],), ([monday], [copy]):
        with pytest.raises(RecordingError, match=r'copy.*monday'):
            require_once(*recordings)
    assert 'monday' in given_twice([monday], [monday])


def test_the_same_motion_with_other_torques_is_another_run(monday):
    """Two runs of a simulated trajectory, or of one without encoder noise."""
    assert not given_twice([monday], [replace(monday, tau=monday.tau + 1e-6)])
    assert not given_twice([monday, replace(monday, tau=None)])
    assert not given_twice([monday])
