# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid call`: services of a running excitation publisher."""

from __future__ import annotations

from armid_ros.cli.terminal import say
import click


@click.command(epilog='Example: armid call rehearse')
@click.argument('action', type=click.Choice(['start', 'rehearse', 'stop', 'speed']))
@click.argument('share', type=click.FloatRange(0.1, 1.0), required=False)
@click.option(
    '--node',
    default='/excitation_publisher',
    show_default=True,
    help='Name of the node, with its namespace.',
)
@click.option(
    '--timeout',
    type=click.FloatRange(0.0, min_open=True),
    default=5.0,
    show_default=True,
    help='Longest time to wait for an answer [s].',
)
def call(action: str, share: float | None, node: str, timeout: float) -> None:
    """
    Start, rehearse or stop the run of an excitation_publisher, or set the speed of the run.

    SHARE, 0.1 to 1, is for the action speed: share of the planned speed at the next start.

    """
    if (action == 'speed') != (share is not None):
        raise click.UsageError("SHARE is only for the action 'speed', as in armid call speed 0.5")
    from armid_ros.nodes.calls import call_publisher

    say(call_publisher(node, action, share, timeout))
