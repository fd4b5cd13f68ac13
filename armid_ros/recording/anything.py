# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read a recording from a bag of ROS 2 or ROS 1, or from a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from armid_ros.errors import RecordingError
from armid_ros.recording.bag import is_bag_file
from armid_ros.recording.columns import (
    ColumnSettings,
    in_si,
    name_in_file,
    refuse_columns,
    renamed,
)
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.reader import bag_contents, read_recording
from armid_ros.recording.recording import Recording
from armid_ros.recording.source import DEFAULT, listed, ReadSettings, Topic

if TYPE_CHECKING:
    from armid_ros.recording.tables import TablePlan

#: Callback that shows the plan of a table.
Show = Callable[['TablePlan'], None]
#: Package that reads tables, a plug-in.
_TABLES = 'armid_ros.recording.tables'


def is_table(path: Path) -> bool:
    """Return whether a path is a table; without the package `tables`, all but bags are tables."""
    if find_spec(_TABLES) is None:
        return path.is_file() and not is_bag_file(path)
    from armid_ros.recording import tables

    return tables.is_table(path)


def read_tables(
    paths: Sequence[Path],
    columns: ColumnSettings,
    joints: Sequence[str] | None = None,
    slides: Sequence[bool] | None = None,
    show: Show | None = None,
) -> Recording:
    """
    Read the measurements of some joints from tables of the same samples.

    Parameters
    ----------
    paths : sequence of Path
        Files with the columns of the same samples.
    columns : ColumnSettings
        Which columns hold which quantity, in which unit; missing settings are guessed.
    joints : sequence of str, optional
        Joints to read, in this order; by default named by the columns.
    slides : sequence of bool, optional
        Whether each joint is prismatic.
    show : callable, optional
        Called with the plan before the columns are converted.

    Raises
    ------
    RecordingError
        If a file cannot be read, or the package that reads tables is not installed.

    """
    if find_spec(_TABLES) is None:
        raise RecordingError(
            f'{paths[0]}: not a bag; reading a table needs {_TABLES}, which this installation '
            'does not have'
        )
    from armid_ros.recording.tables import measured, open_table, plan, side_by_side

    table = side_by_side([open_table(path, episode=columns.episode) for path in paths])
    settled = plan(table, columns, joints, slides)
    if show is not None:
        show(settled)
    return measured(settled)


def read_anything(
    path: str | Path,
    *,
    joints: Sequence[str] | None = None,
    slides: Sequence[bool] | None = None,
    topics: Sequence[Topic] | None = None,
    topic: str | None = None,
    columns: ColumnSettings | None = None,
    show: Show | None = None,
    settings: ReadSettings = DEFAULT,
) -> Recording:
    """
    Read the measurements of some joints from a bag or a table.

    Parameters
    ----------
    path : str or Path
        A bag that ``read_recording`` reads, or a table: CSV, NPZ, MAT, Parquet, or the folder of a
        LeRobot dataset.
    joints : sequence of str, optional
        Joints to read, in this order; by default all of the table or topic.
    slides : sequence of bool, optional
        Whether each joint is prismatic. Positions of prismatic joints are never in degrees.
    topics : sequence of Topic, optional
        Topics of the bag with their joints, if known, for the default of ``joints``.
    topic : str, optional
        Topic of the bag. Needed if the bag has several topics of JointState; without ``joints``
        by default the one with the most messages.
    columns : ColumnSettings, optional
        Which columns of a table hold which quantity, in which unit. Missing settings are guessed
        from the file. Names, units, zeros and gears apply to bags too; columns and rate do not.
    show : callable, optional
        Called with the plan of a table before the table is read.
    settings : ReadSettings, optional
        Which checks are made when a bag is read, and the memory limit.

    Raises
    ------
    RecordingError
        If the file cannot be read. The message names the file, the topic, joint, column or line,
        and the remedy.

    """
    path = Path(path)
    columns = columns or ColumnSettings()
    if is_table(path):
        return read_tables([path], columns, joints, slides, show)
    if columns.temperature == 'none':
        columns = replace(columns, temperature=None)
        settings = replace(settings, temperatures=False)
    refuse_columns(path, columns)
    if joints is None:
        topics = bag_contents(path, settings) if topics is None else topics
        there = [one for one in topics if one.joints]
        if topic is not None:
            there = [one for one in there if one.name.lstrip('/') == topic.lstrip('/')]
        if not there:
            which = f'{topic} of ' if topic else 'topic of '
            raise RecordingError(f'{path}: no {which}{JOINT_STATE}; there are {listed(topics)}')
        fullest = max(there, key=lambda one: one.count)
        topic, joints = fullest.name, fullest.joints
    called = [name_in_file(joint, columns.rename) for joint in joints]
    recording = read_recording(path, joints=called, topic=topic, settings=settings)
    others = tuple(
        replace(other, joint=renamed(other.joint, columns.rename)) for other in recording.others
    )
    named = replace(recording, joints=tuple(joints), others=others)
    return in_si(named, columns, slides)
