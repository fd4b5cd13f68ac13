# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording from whatever holds one: a bag of ROS 2 or ROS 1, a table."""

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
        What ``read_recording`` takes, a .bag of ROS 1, or a table: CSV, NPZ, MAT, Parquet, the
        folder of a LeRobot dataset.
    joints : sequence of str
        The joints wanted, in this order.
    slides : sequence of bool, optional
        Whether each of them is prismatic, which has no degrees.
    topic : str, optional
        Of a bag, where it has several of JointState.
    columns : ColumnSettings, optional
        Of a table: which columns are what, in which unit; what is not said is guessed. Names,
        units, zeros and gears count for bags too; which columns are what, and their rate, do not.
    show : callable, optional
        Given the plan of a table before it is read.
    settings : ReadSettings, optional
        How careful bags are read.

    Raises
    ------
    RecordingError
        Naming the file, and the topic, joint, column or line, and what to do.

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
