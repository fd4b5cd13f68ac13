# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Calls to a running excitation publisher."""

from __future__ import annotations

from armid_ros.cli.terminal import say
import click


def call(action: str, share: float | None, node: str, timeout: float) -> None:
    """Start, rehearse or stop the run of an excitation_publisher, or set its speed."""
    if (action == 'speed') != (share is not None):
        raise click.UsageError('SHARE belongs to speed, such as armid call speed 0.5')
    from armid_ros.nodes.calls import call_publisher

    say(call_publisher(node, action, share, timeout))
