# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is in a recording, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli.signatures import columns, options
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid inspect run.mcap --robot ur10.urdf --out look')
@click.argument('bag', type=click.Path(path_type=Path))
@options.robot_described(
    help='Shipped name, path of a URDF, or - for the one in the bag; limits and units are '
    'checked with it, and an identification is tried.',
)
@click.option(
    '--out',
    type=options.OutPath(file_okay=False, path_type=Path),
    help='Folder to put the page with all curves into.',
)
@options.force
@columns.options
@options.topic
@options.gravity
@options.joints
@options.seed
@options.reading
@options.as_json
@done_by('inspect')
def inspect() -> None:
    """
    Look at a recording: a bag, or a table.

    Topics, joints, rate, gaps, ranges, units that look wrong, whether the motion repeats, and with
    a robot whether identify takes it. Without --out it is printed only.

    """
