# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From tables and bags of ROS 1 to bags."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli.signatures import columns, options
from armid_ros.cli.signatures.late import done_by
import click


@click.command(
    epilog="Example: armid convert run.csv --robot ur10.urdf --effort 'tau{}' --out run"
)
@click.argument('files', nargs=-1, required=True, type=click.Path(path_type=Path))
@options.robot_described(
    help='Shipped name or path of a URDF, whose joints the columns become; without it, joints '
    'are called as the columns are.',
)
@click.option('--out', type=options.OutPath(path_type=Path), help='Bag to write; must not exist.')
@click.option('--dry-run', is_flag=True, help='Show what would be read from where; write nothing.')
@columns.options
@options.reading
@options.joints
@done_by('convert')
def convert() -> None:
    """
    Make a bag of a table or of a bag of ROS 1.

    Tables are CSV (.tsv, .txt, .gz too), NPZ and NPY, MAT, HDF5, Parquet, and folders of LeRobot
    datasets. Columns that are not named are guessed, and shown. Several tables hold columns of the
    same rows. Bags of ROS 1 and ROS 2 are copied, joints renamed.

    """
