# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a node says of itself when it is asked for help instead of being started."""

from __future__ import annotations

from collections.abc import Sequence
import inspect
from pathlib import Path
import textwrap

from armid_ros.nodes.base import ArmidNode, COMMON
from armid_ros.nodes.parameters.table import NodeParameter

_WIDTH = 99


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
    if parameter.lower is not None and parameter.upper is not None:
        limits = f' {parameter.lower:g} to {parameter.upper:g}.'
    text = textwrap.fill(
        f'{parameter.text()}{limits}', _WIDTH, initial_indent=' ' * 6, subsequent_indent=' ' * 6
    )
    return f'  {parameter.name}:={_written(parameter.default)}\n{text}'


def _written(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"'{value}'" if isinstance(value, str) else str(value)
