# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments that a node cannot have are named, with how they are written."""

import gc

from armid_ros.nodes.parameters.table import ParameterError
from armid_ros.nodes.recorder import RecorderNode
from armid_ros.nodes.running.process import _made, steady, unreadable
import pytest
import rclpy
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.context import Context
from threadpoolctl import threadpool_info, threadpool_limits


@pytest.mark.parametrize(
    'arguments',
    [
        ['-p', 'bag'],
        ['-r', '__node:=not-a-name'],
        ['--params-file', 'nope.yaml'],
        ['--log-level', 'x'],
        ['--nonsense'],
    ],
)
def test_what_ros_cannot_read_is_named(arguments):
    with pytest.raises((RCLError, UnknownROSArgsError)) as error:
        Context().init(['--ros-args', *arguments])
    said = unreadable(error.value)
    assert ' '.join(arguments) in said and 'NAME:=VALUE' in said and ' at /' not in said


def test_a_file_that_is_none_of_parameters_is_named_with_the_line(tmp_path):
    path = tmp_path / 'run.yaml'
    path.write_text('recorder:\n  rate: 3\n')
    with pytest.raises(RCLError) as error:
        Context().init(['--ros-args', '--params-file', str(path)])
    assert str(path) in unreadable(error.value) and 'line 2' in unreadable(error.value)


def test_arguments_that_are_none_of_ros_are_named():
    try:
        with pytest.raises(ParameterError, match=r'robot:=my_arm\.urdf: .*NAME:=VALUE'):
            _made(RecorderNode, ['robot:=my_arm.urdf', '--ros-args', '-p', 'record:=false'])
    finally:
        rclpy.try_shutdown()


def test_linear_algebra_has_one_thread_and_old_objects_are_not_looked_through():
    def threads():
        return {library['num_threads'] for library in threadpool_info()}

    with threadpool_limits(limits=2):
        with steady():
            assert threads() == {1} and gc.get_freeze_count() > 0
        assert 2 in threads() and gc.get_freeze_count() == 0
