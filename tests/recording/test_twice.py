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
    assert given_twice([monday, copy]).endswith(': copy (is monday)')
    assert given_twice([monday], [copy]).endswith(': copy (is monday)')
    assert given_twice([monday], [monday]).endswith(': monday')
    with pytest.raises(RecordingError, match=r'copy .is monday.; give each recording once'):
        require_once([monday], [copy])


def test_the_same_motion_with_other_torques_is_another_run(monday):
    """Two runs of a simulated trajectory, or of one without encoder noise."""
    assert not given_twice([monday], [replace(monday, tau=monday.tau + 1e-6)])
    assert not given_twice([monday, replace(monday, tau=None)])
    assert not given_twice([monday])
