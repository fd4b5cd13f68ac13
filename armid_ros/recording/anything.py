# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Read a recording from a bag of ROS 2 or ROS 1, or from a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from armid_ros.recording.reader import read_recording
from armid_ros.recording.recording import Recording
from armid_ros.recording.settings import DEFAULT, ReadSettings
from armid_ros.recording.tables import (
    ColumnSettings,
    in_si,
    is_table,
    measured,
    name_in_file,
    open_table,
    plan,
    refuse_columns,
    renamed,
    TablePlan,
)

Show = Callable[[TablePlan], None]


def read_anything(
    path: str | Path,
    *,
    joints: Sequence[str],
    slides: Sequence[bool] | None = None,
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
    joints : sequence of str
        Joints to read, in this order.
    slides : sequence of bool, optional
        Whether each joint is prismatic. Positions of prismatic joints are never in degrees.
    topic : str, optional
        Topic of the bag. Needed if the bag has several topics of JointState.
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
        table = open_table(path, episode=columns.episode)
        settled = plan(table, columns, joints, slides)
        if show is not None:
            show(settled)
        return measured(settled)
    refuse_columns(path, columns)
    called = [name_in_file(joint, columns.rename) for joint in joints]
    recording = read_recording(path, joints=called, topic=topic, settings=settings)
    others = tuple(
        replace(other, joint=renamed(other.joint, columns.rename)) for other in recording.others
    )
    named = replace(recording, joints=tuple(joints), others=others)
    return in_si(named, columns, slides)
