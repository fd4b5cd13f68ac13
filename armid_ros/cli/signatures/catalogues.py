# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is shipped and what can be named."""

from __future__ import annotations

from armid_ros.cli.signatures import options
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid robots')
@options.as_json
@done_by('catalogues')
def robots() -> None:
    """List the robots that are shipped."""


@click.command(epilog='Example: armid effects --json')
@options.as_json
@done_by('catalogues')
def effects() -> None:
    """List the effects that can be simulated and estimated."""
