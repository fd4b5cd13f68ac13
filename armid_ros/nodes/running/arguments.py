# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments of a node: what is wrong with them, in a line that names them, and its help."""

from __future__ import annotations

from collections.abc import Sequence
import inspect
from pathlib import Path
import re
import textwrap

from armid_ros.nodes.base import ArmidNode, COMMON
from armid_ros.nodes.parameters.table import NodeParameter
from rclpy.utilities import remove_ros_args

#: How rules of ROS are written.
_WRITTEN = {'-p': '-p NAME:=VALUE', '-r': '-r NAME:=OTHER_NAME'}
_FILE = '--params-file'
_WIDTH = 99


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
            if not Path(value).exists():
                return f'{value}: there is no such file ({_FILE})'
            detail = rule[2].strip('. ')
            return f'{value}: cannot be read as a file of parameters ({_FILE}): {detail}'
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


def is_asked_for(args: Sequence[str]) -> bool:
    """Return whether arguments ask for help; what follows --ros-args is for ROS."""
    own = args[: list(args).index('--ros-args')] if '--ros-args' in args else args
    return bool({'-h', '--help'} & set(own))


def usage(node: type[ArmidNode]) -> str:
    """
    Return what a node is for, and its parameters.

    Parameters
    ----------
    node : type
        Class of the node, in the module that is named as its executable.

    """
    program = Path(inspect.getfile(node)).stem
    purpose = inspect.getdoc(node) or ''
    parts = [
        f'Usage: {program} --ros-args -p NAME:=VALUE ... -r TOPIC:=OTHER_TOPIC ...',
        purpose.partition('\nAttributes\n')[0].strip(),
        'Parameters, with their defaults:',
        '\n'.join(_line(parameter) for parameter in (*node.table, *COMMON)),
    ]
    return '\n\n'.join(parts)


def _line(parameter: NodeParameter) -> str:
    limits = ''
    if parameter.limits is not None:
        limits = f' {parameter.limits[0]:g} to {parameter.limits[1]:g}.'
    text = textwrap.fill(
        f'{parameter.text()}{limits}', _WIDTH, initial_indent=' ' * 6, subsequent_indent=' ' * 6
    )
    value = parameter.default
    written = str(value).lower() if isinstance(value, bool) else str(value)
    if isinstance(value, str):
        written = f"'{value}'"
    return f'  {parameter.name}:={written}\n{text}'
