# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Several senders with some of the joints each become one stream of all joints."""

from __future__ import annotations

from armid_ros.errors import RecordingError
from armid_ros.identification.samples.joint_merge import joint_places, JointMerger
import numpy as np
import pytest


def sent(merger, joints, t):
    """Let a sender say 10 t + joint of each of its joints, a line that interpolation keeps."""
    return merger.take(joints, t, 10.0 * t + np.array([joints], dtype=float))


@pytest.mark.parametrize(('late', 'every'), [(0.0, 1), (0.003, 1), (0.009, 1), (0.001, 4)])
def test_samples_are_those_of_the_first_joint_with_the_others_interpolated(late, every):
    """A sender may be late, or have another rate."""
    merger, found = JointMerger(3), []
    for k in range(200):
        found += sent(merger, (2, 0), 0.01 * k)
        if k % every == 0:
            found += sent(merger, (1,), 0.01 * k + late)
    assert len(found) >= 200 - 5 * every
    for t, x in found:
        np.testing.assert_allclose(x, [10.0 * t + np.arange(3.0)], atol=1e-9)


def test_what_one_sender_has_missed_is_not_made_up():
    merger, found = JointMerger(2), []
    for k in range(200):
        found += sent(merger, (0,), 0.01 * k)
        if not 50 < k < 150:
            found += sent(merger, (1,), 0.01 * k)
    stamps = [t for t, _ in found]
    assert not any(0.52 < t < 1.48 for t in stamps)
    assert len(stamps) == pytest.approx(100, abs=3)


def test_a_clock_that_is_set_back_begins_anew():
    merger = JointMerger(2)
    for k in range(20):
        sent(merger, (0,), 100.0 + 0.01 * k)
        sent(merger, (1,), 100.0 + 0.01 * k)
    found = []
    for k in range(20):
        found += sent(merger, (0,), 0.01 * k)
        found += sent(merger, (1,), 0.01 * k)
    assert len(found) >= 18


def test_nothing_grows_while_one_sender_waits_for_another():
    merger = JointMerger(2)
    sent(merger, (1,), -1.0)
    assert merger.missing == (0,)
    for k in range(5000):
        assert not sent(merger, (0,), 0.001 * k)
    assert sum(len(part.samples) for part in merger._parts.values()) <= 1001


def test_joints_are_found_by_name_in_any_order():
    np.testing.assert_array_equal(joint_places(('b', 'a'), ['a', 'gripper', 'b']), [2, 0])
    for names, fact in ((['a', 'c'], r'b; .*a, c'), (['a', 'b', 'a'], 'a twice')):
        with pytest.raises(RecordingError, match=fact):
            joint_places(('b', 'a'), names)
