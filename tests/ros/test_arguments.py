# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments that a node cannot have are named, with how they are written."""

from __future__ import annotations

import re

from armid_ros.nodes.running.process import stray, unreadable
import pytest
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.context import Context


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (['-p', 'bag'], '-p bag: .*NAME:=VALUE'),
        (['-p'], '-p: .*NAME:=VALUE'),
        (['-r', 'here'], '-r here: .*NAME:=OTHER_NAME'),
        (['-r', '__node:=not-a-name'], '-r __node:=not-a-name: .*NAME:=OTHER_NAME'),
        (['--params-file', 'nope.yaml'], 'nope.yaml: .*--params-file'),
        (['--log-level', 'x'], '--log-level x: '),
        (['--nonsense'], '--nonsense: .*--help'),
    ],
)
def test_what_ros_cannot_read_is_named(arguments, said):
    with pytest.raises((RCLError, UnknownROSArgsError)) as error:
        Context().init(['--ros-args', *arguments])
    assert re.match(said, unreadable(error.value))


def test_a_file_that_is_none_of_parameters_is_named_with_the_line(tmp_path):
    path = tmp_path / 'run.yaml'
    path.write_text('recorder:\n  rate: 3\n')
    with pytest.raises(RCLError) as error:
        Context().init(['--ros-args', '--params-file', str(path)])
    said = unreadable(error.value)
    assert said.startswith(f'{path}: ') and said.endswith('line 2')


@pytest.mark.parametrize('others', [['robot:=my_arm.urdf'], ['--robot', 'my_arm.urdf']])
def test_arguments_that_are_none_of_ros_are_named(others):
    said = stray([*others, '--ros-args', '-p', 'rate:=200.0'], 'simulated_arm')
    assert said.startswith(f'{" ".join(others)}: simulated_arm ')
    assert stray(['--ros-args', '-p', 'rate:=200.0', '--'], 'simulated_arm') == ''
