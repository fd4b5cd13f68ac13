# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options for a machine or a person that was recorded beside the arm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

_Command = TypeVar('_Command', bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        '--partner',
        metavar='R',
        help='Shipped name, URDF or xacro of a machine or person recorded in the same bags, to '
        'which the arm may be tied, such as the wearer of an exoskeleton.',
    ),
    click.option('--partner-topic', help="The partner's JointState topic, where several name it."),
    click.option(
        '--tie',
        'ties',
        multiple=True,
        metavar='JOINT=JOINT',
        help="Where they may be tied: a joint of the arm and one of the partner, whose links' "
        'centroids the tie joins, or points of them, JOINT@X,Y,Z=JOINT@X,Y,Z [m]. By default '
        'links of equal number.',
    ),
)


def options(command: _Command) -> _Command:
    """Give a command the options --partner, --partner-topic and --tie."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
