# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Check the arguments of a node, and format its help."""

from __future__ import annotations

from collections.abc import Sequence
import inspect
from pathlib import Path
import re
import textwrap

from armid_ros.nodes.base import ArmidNode, COMMON
from rclpy.utilities import remove_ros_args

#: Syntax of ROS arguments.
_WRITTEN = {'-p': '-p NAME:=VALUE', '-r': '-r NAME:=OTHER_NAME'}
_FILE = '--params-file'


def unreadable(error: Exception) -> str:
    """
    Return a text that names the argument ROS cannot read, with its syntax.

    Parameters
    ----------
    error : Exception
        Exception that rclpy raised for the arguments.

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
    Return a text that names arguments that are not ROS arguments; empty if none.

    Parameters
    ----------
    args : sequence of str
        All arguments without the name of the program; the ROS arguments are valid.
    program : str
        Name of the program.

    """
    others = remove_ros_args([program, *args])[1:]
    if not others:
        return ''
    return (
        f'{" ".join(others)}: {program} takes only ROS arguments; write parameters as '
        '--ros-args -p NAME:=VALUE, and see --help'
    )


def is_asked_for(args: Sequence[str]) -> bool:
    """Return whether --help is among the arguments before --ros-args."""
    own = args[: list(args).index('--ros-args')] if '--ros-args' in args else args
    return bool({'-h', '--help'} & set(own))


def usage(node: type[ArmidNode]) -> str:
    """
    Format the help of a node: its purpose and parameters.

    Parameters
    ----------
    node : type
        Class of the node; its module has the name of the executable.

    """
    program = Path(inspect.getfile(node)).stem
    purpose = inspect.getdoc(node) or ''
    lines = []
    for parameter in (*node.table, *COMMON):
        value, text = parameter.default, parameter.text()
        if parameter.limits is not None:
            text += f' {parameter.limits[0]:g} to {parameter.limits[1]:g}.'
        written = str(value).lower() if isinstance(value, bool) else str(value)
        lines.append(
            f"  {parameter.name}:='{value}'"
            if isinstance(value, str)
            else f'  {parameter.name}:={written}'
        )
        lines += textwrap.wrap(text, 99, initial_indent=' ' * 6, subsequent_indent=' ' * 6)
    parts = [
        f'Usage: {program} --ros-args -p NAME:=VALUE ... -r TOPIC:=OTHER_TOPIC ...',
        purpose.partition('\nAttributes\n')[0].strip(),
        'Parameters, with their defaults:',
        '\n'.join(lines),
    ]
    return '\n\n'.join(parts)
