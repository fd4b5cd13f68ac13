# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is said of units and sides is said of a bag too; what a bag has by itself is refused."""

from dataclasses import replace

from armid_ros.errors import RecordingError
from armid_ros.motion import Motion
from armid_ros.recording import write_recording
from armid_ros.recording.columns import ColumnSettings, in_si
from armid_ros.recording.reader import read_recording
from armid_ros.recording.recording import PositionRange
import numpy as np
import pytest

JOINTS = ('lift', 'elbow')


@pytest.fixture
def bag(tmp_path):
    """Write a bag of a joint that slides and one that turns."""
    t = 0.01 * np.arange(200)
    q = np.column_stack([0.3 * np.sin(t), np.sin(2 * t)])
    motion = Motion(JOINTS, t, q, np.gradient(q, t, axis=0), np.zeros_like(q))
    write_recording(tmp_path / 'bag', motion.with_torque(np.column_stack([q[:, 0], 2 * q[:, 1]])))
    return tmp_path / 'bag'


def read(bag, **said):
    return read_recording(bag, joints=JOINTS, slides=(True, False), columns=ColumnSettings(**said))


@pytest.mark.parametrize(
    ('said', 'position', 'effort', 'zero'),
    [
        ({'effort_scale': (4.0,)}, (1, 1), (4, 4), (0, 0)),
        ({'effort_scale': (4.0, -2.0)}, (1, 1), (4, -2), (0, 0)),
        ({'degrees': True}, (1, np.pi / 180), (1, 1), (0, 0)),
        ({'position_scale': (1e-3, 1.0)}, (1e-3, 1), (1, 1), (0, 0)),
        ({'zero': (0.1, -0.2)}, (1, 1), (1, 1), (0.1, -0.2)),
        ({'gear': (50.0, 100.0)}, (1 / 50, 1 / 100), (50, 100), (0, 0)),
    ],
)
def test_units_and_sides_are_those_of_the_bag(bag, said, position, effort, zero):
    plain, found = read(bag), read(bag, **said)
    np.testing.assert_allclose(found.q, plain.q * position + np.array(zero), atol=1e-12)
    np.testing.assert_allclose(found.dq, plain.dq * position, atol=1e-12)
    np.testing.assert_allclose(found.tau, plain.tau * effort, atol=1e-12)
    np.testing.assert_array_equal(found.t, plain.t)


@pytest.mark.parametrize(
    ('said', 'option'),
    [
        ({'rate_hz': 200.0}, '--rate'),
        ({'time_unit': 'ms'}, '--time-unit'),
        ({'time': 't'}, '--time'),
        ({'effort': 'amps_{}'}, '--effort'),
        ({'episode': 1}, '--episode'),
    ],
)
def test_what_a_bag_has_by_itself_is_refused_with_option_and_bag(bag, said, option):
    with pytest.raises(RecordingError, match=f'^{bag}: {option} '):
        read(bag, **said)


def test_other_joints_are_where_they_are_in_the_unit_of_those_asked_for(bag):
    recording = replace(read(bag), others=(PositionRange('gripper', -90.0, 45.0),))
    (one,) = in_si(recording, ColumnSettings(degrees=True)).others
    assert (one.lowest, one.highest) == pytest.approx((-np.pi / 2, np.pi / 4))
    assert in_si(recording, ColumnSettings(degrees=True), (True, False)).others == ()
    assert in_si(recording, ColumnSettings(zero=(1.0,))).others == ()
