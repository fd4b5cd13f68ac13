# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Conversion of tables and ROS 1 bags to ROS 2 bags."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from armid_ros.cli import columns, parameters
from armid_ros.cli.terminal import say
from armid_ros.errors import RecordingError
import click

if TYPE_CHECKING:
    from armid_ros.recording.tables import TablePlan
    from armid_ros.robots import Robot


@click.command(
    epilog="Example: armid convert run.csv --robot ur10.urdf --effort 'tau{}' --out run"
)
@click.argument('files', nargs=-1, required=True, type=click.Path(path_type=Path))
@parameters.robot_described(
    help='Shipped name or path of a URDF with the joints of the columns; by default joints get '
    'the names of the columns.',
)
@click.option(
    '--out', type=parameters.OutPath(path_type=Path), help='Bag to write; must not exist.'
)
@click.option('--dry-run', is_flag=True, help='Show which columns are read; write nothing.')
@columns.options
@parameters.reading
@parameters.joints
def convert(
    files: tuple[Path, ...],
    robot_source: str | None,
    out: Path | None,
    dry_run: bool,
    joints: str | None,
) -> None:
    """
    Convert a CSV, NPZ, ... table or a ROS 1 bag into a ROS 2 bag.

    Tables are CSV (.tsv, .txt, .gz too), NPZ and NPY, MAT, HDF5, Parquet, and folders of LeRobot
    datasets. Columns without an option are guessed and printed. Several tables are joined column
    by column and need equal rows. Bags of ROS 1 are copied.

    """
    from armid_ros.cli import options
    from armid_ros.recording.reader import is_table

    if out is None and not dry_run:
        raise click.UsageError(
            'no output was named: give --out with the bag to write, or --dry-run to write nothing'
        )
    robot = None
    if robot_source is not None:
        robot = options.open_robot(robot_source, 'earth', joints)
    if all(is_table(path) for path in files):
        _convert_tables(files, robot, joints, None if dry_run else out)
        return
    if len(files) > 1:
        named = ', '.join(str(path) for path in files)
        raise RecordingError(f'{named}: only tables can be joined; convert bags one by one')
    _convert_bag(files[0], None if dry_run else out)


def _convert_tables(
    files: tuple[Path, ...], robot: Robot | None, joints: str | None, out: Path | None
) -> None:
    """Convert tables to one bag; without an output path, only print recognised columns."""
    from armid_ros.files.cells import listed
    from armid_ros.recording import write_recording
    from armid_ros.recording.reader import read_tables

    def show(plan: TablePlan) -> None:
        for line in plan.lines():
            say(line)

    names = None if robot is None else robot.joints
    if robot is None and joints:
        names = listed(joints)
    slides = None if robot is None else list(robot.prismatic)
    recording = read_tables(files, columns.settings(), names, slides, show)
    rate = 1.0 / recording.period
    say(f'  {recording.report.describe()} {recording.duration:.2f} s at {rate:.4g} Hz')
    if out is None:
        say('nothing was written; give --out BAG without --dry-run to write a bag')
        return
    write_recording(out, recording, robot_description=None if robot is None else robot.urdf)
    say(f'{out}: {len(recording)} samples of {recording.n_joints} joints')


def _convert_bag(path: Path, out: Path | None) -> None:
    """Convert a ROS 1 bag to a ROS 2 bag, and print the copied topics."""
    from armid_ros.cli import options
    from armid_ros.recording import copy_bag, topics
    from armid_ros.recording.columns import refuse_columns

    refuse_columns(path, columns.settings(), copied=True)
    if out is None:
        raise RecordingError(
            f'{path}: this is a bag, but --dry-run shows tables only; use armid inspect {path}'
        )
    if path.suffix.lower() != '.bag':  # the suffix of ROS 1
        topics(path)  # raises an error if the path is not a bag
        raise RecordingError(f'{path}: this is a bag of ROS 2 already; it needs no conversion')
    copied = copy_bag(path, out, options.read_settings())
    for topic in copied.topics:
        say(f'  {topic.name} ({topic.type_name}): {topic.count} messages')
    for text in copied.left_out:
        say(f'  left out: {text}')
    if copied.damage:
        say(f'  {copied.damage}')
    say(f'{out}: {copied.messages} messages')
