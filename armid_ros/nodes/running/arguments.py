# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the arguments of a node, in a line that names them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import re

from rclpy.utilities import remove_ros_args

#: How rules of ROS are written.
_WRITTEN = {'-p': '-p NAME:=VALUE', '-r': '-r NAME:=OTHER_NAME'}
_FILE = '--params-file'


def unreadable(error: Exception) -> str:
    """
    Say which argument ROS cannot read, and how it is written.

    Parameters
    ----------
    error : Exception
        What rclpy raised of them.

    """
    text = re.sub(r',? at /\S+:\d+', '', str(error)).removeprefix('failed to initialize rcl: ')
    text = ' '.join(text.split())
    rule = re.search(r"Couldn't parse [\w ]+: '(.*)'\. Error: (.*)", text)
    if rule:
        flag, _, value = rule[1].partition(' ')
        if flag == _FILE:
            return _of_file(value, rule[2])
        how = _WRITTEN.get(flag)
        return f'{rule[1]}: {f"write {how}" if how else rule[2]}'
    alone = re.search(r"Couldn't parse trailing (\S+) flag", text)
    if alone:
        return (
            f'{alone[1]}: nothing follows it; write {_WRITTEN.get(alone[1], f"{alone[1]} VALUE")}'
        )
    unknown = re.findall(r"'([^']*)'", text)
    if text.startswith('[') and unknown:
        return f'{" ".join(unknown)}: unknown after --ros-args; see --help'
    return text


def stray(args: Sequence[str], program: str) -> str:
    """
    Say which arguments are none of ROS, as nodes have no others; empty where there are none.

    Parameters
    ----------
    args : sequence of str
        All arguments, without the name of the program; ROS can read them.
    program : str
        Its name.

    """
    others = remove_ros_args([program, *args])[1:]
    if not others:
        return ''
    return (
        f'{" ".join(others)}: {program} takes arguments of ROS alone; write parameters as '
        '--ros-args -p NAME:=VALUE, and see --help'
    )


def _of_file(path: str, detail: str) -> str:
    if not Path(path).exists():
        return f'{path}: there is no such file ({_FILE})'
    return f'{path}: cannot be read as a file of parameters ({_FILE}): {detail.strip(". ")}'
