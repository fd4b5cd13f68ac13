# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The paper on the humanoid arm for the moon, repeated by one command."""

from __future__ import annotations

from armid_ros.cli import parameters as options
from armid_ros.cli.late import done_by
import click


@click.command(epilog='Example: armid lunar --out result')
@options.folder
@options.seed
@options.as_json
@done_by('armid_ros.papers.lunar.work')
def lunar() -> None:
    """Repeat the lunar paper: its tables, gravity parameters and torques, beside its figures."""
