# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The paper on the humanoid arm for the moon, repeated by one command."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli import parameters as options
import click


@click.command(epilog='Example: armid lunar --out result')
@options.folder
@options.seed
@options.as_json
def lunar(out: Path, seed: int, as_json: bool) -> None:
    """Repeat the lunar paper: its tables, gravity parameters and torques, beside its figures."""
    from armid_ros.papers.lunar.work import repeat_paper

    repeat_paper(out, seed, as_json)
