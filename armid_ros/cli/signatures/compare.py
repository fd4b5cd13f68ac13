# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What changed between two identifications."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli.signatures import options
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid compare monday friday --out changes')
@click.argument('before', metavar='A', type=click.Path(path_type=Path))
@click.argument('after', metavar='B', type=click.Path(path_type=Path))
@options.folder
@click.option('--strict', is_flag=True, help='End with code 3 if one of them is unusable.')
@options.as_json
@done_by('compare')
def compare() -> None:
    """
    Say what changed between two identifications of one robot.

    A and B are folders that identify wrote, identification.json or model.yaml.

    """
