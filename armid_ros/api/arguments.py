# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a person passes, and what the packages below take: a path for a robot, an int for a rng."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict

from armid_ros.arm import ArmModel, load_model
from armid_ros.effects import USUAL_EFFECTS
from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording import ReadSettings, Recording, Topic
from armid_ros.recording.anything import read_anything
from armid_ros.recording.message_types import JOINT_STATE
from armid_ros.recording.reader import bag_contents
from armid_ros.recording.settings import DEFAULT
from armid_ros.recording.tables import (
    ColumnSettings,
    is_table,
    measured,
    open_table,
    plan,
    TablePlan,
)
from armid_ros.recording.tables.settings import numbers
from armid_ros.robots import load_robot, Robot, shipped_robots
from armid_ros.robots.shipped import shipped_path
import numpy as np

#: A robot: as it is, as part of a model, by a shipped name, or by the path of its description or
#: of the model.yaml of one.
RobotLike = Robot | ArmModel | str | Path
#: A recording: as it is, or the path of a bag or a table.
RecordingLike = Recording | str | Path
#: A generator, or the seed of one.
Rng = np.random.Generator | int
#: Is called with the share of the work that is done and, where it changes, what is being done.
Progress = Callable[..., None]

#: Effects that are fitted with the rigid body by default.
USUAL = ','.join(USUAL_EFFECTS)


class DesignKeywords(TypedDict, total=False):
    """Further keywords of `armid_ros.design_excitation`, which has what they are."""

    speed: str | float
    criterion: str
    target: str
    focus: tuple[str, ...]
    harmonics: int
    acceleration: FloatArray | None
    noise: FloatArray | None
    clearance: float
    starts: int
    iterations: int
    candidates: int
    time_budget: float


def robot_of(robot: RobotLike) -> Robot:
    """Return the robot that is meant."""
    if isinstance(robot, ArmModel):
        return robot.robot
    if isinstance(robot, Robot):
        return robot
    return load_model(robot).robot if is_model(robot) else load_robot(str(robot))


def is_model(path: str | Path) -> bool:
    """Return whether a path is that of a model.yaml, and not of a description."""
    return Path(path).suffix in ('.yaml', '.yml')


def source_of(robot: Robot) -> str:
    """Return how files refer to a robot: by its shipped name, its path, or its name."""
    for name in shipped_robots():
        if robot.path == shipped_path(name):
            return name
    return robot.name if robot.path is None else str(Path(robot.path).resolve())


def arm_of(arm: RobotLike, effects: str = USUAL) -> ArmModel:
    """Return the model that is meant; a robot alone gets the usual friction."""
    if isinstance(arm, ArmModel):
        return arm
    if not isinstance(arm, Robot) and is_model(arm):
        return load_model(arm)
    return ArmModel.of(arm if isinstance(arm, Robot) else str(arm), effects=effects)


def recordings_of(
    recordings: RecordingLike | Sequence[RecordingLike], robot: Robot
) -> list[Recording]:
    """Return recordings, read where they are paths; one, many or none."""
    several = recordings if isinstance(recordings, Iterable) else [recordings]
    several = [recordings] if isinstance(recordings, RecordingLike) else list(several)
    for one in several:
        if not isinstance(one, RecordingLike):
            raise RecordingError(
                f'{str(one)[:40]!r} is no recording; give a Recording, or the path of a bag or '
                'a table'
            )
    read = [one if isinstance(one, Recording) else read_recording(one, robot) for one in several]
    for recording in read:
        if recording.joints != robot.joints:
            raise RecordingError(
                f'{recording.source or "recording"}: its joints are '
                f'{", ".join(recording.joints)}, those of {robot.name} '
                f'{", ".join(robot.joints)}; read it with that robot'
            )
    return read


def some_recordings_of(
    recordings: RecordingLike | Sequence[RecordingLike], robot: Robot
) -> list[Recording]:
    """Return recordings as `recordings_of`; RecordingError where there is none."""
    found = recordings_of(recordings, robot)
    if not found:
        raise RecordingError('no recordings: give one bag, table or Recording at least')
    return found


def with_sources_apart(*groups: list[Recording]) -> tuple[list[Recording], ...]:
    """Return recordings of which each has a source of its own, numbered where two are alike."""
    taken: dict[str, int] = {}

    def named(recording: Recording) -> Recording:
        source = recording.source or 'recording'
        if Path(source).exists():  # the same one, if it is given twice
            return recording
        taken[source] = count = taken.get(source, 0) + 1
        return replace(recording, source=source if count == 1 else f'{source} {count}')

    return tuple([named(recording) for recording in group] for group in groups)


def read_recording(
    path: str | Path,
    robot: RobotLike | Sequence[str] | None = None,
    *,
    topic: str | None = None,
    **columns: Any,
) -> Recording:
    """
    Read the joints of a robot from a bag or a table.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory, .mcap, .db3, .bag, .csv, .npz, .mat, .parquet, or the folder of a
        LeRobot dataset.
    robot : robot, model, name, path, or sequence of str
        Whose joints; a sequence of names does too. By default all joints of a table, or of a bag
        with one topic of JointState, or of ``topic``.
    topic : str, optional
        JointState topic, where a bag has several.
    **columns
        Of a table, as in ColumnSettings: ``position='q{}'``, ``effort='tau{}'``, ``time='t'``,
        ``degrees=True``, ``effort_scale=(11.2, ...)``, ``rename={'fer_': 'panda_'}``. What is not
        said is guessed. Units, scales, zeros, gears and names are those of a bag, too.

    Returns
    -------
    Recording
        Joint positions, velocities and torques.

    Raises
    ------
    RecordingError
        Naming the file, and the topic, joint, column or line, and what to do.

    Examples
    --------
    >>> import armid_ros as ar
    >>> run = ar.read_recording('log.csv', 'my_arm.urdf', effort='amps_{}', effort_scale=4.0)
    >>> run.tau.shape == (len(run), 3)
    True

    """
    said = _settings(columns)
    if robot is None:
        topics = topics_of(Path(path))
        named = [one.name for one in topics if one.joints]
        if topic is None and len(named) > 1:
            raise RecordingError(
                f'{path}: topics of JointState: {", ".join(named)}; give one as topic'
            )
        return read_all_joints(Path(path), topics, topic=topic, columns=said)
    if isinstance(robot, (Robot, ArmModel, str, Path)):
        described = robot_of(robot)
        slides = [bool(one) for one in described.prismatic]
        return read_anything(
            path, joints=described.joints, slides=slides, topic=topic, columns=said
        )
    return read_anything(path, joints=tuple(robot), topic=topic, columns=said)


def topics_of(path: Path, settings: ReadSettings = DEFAULT) -> tuple[Topic, ...]:
    """Return the topics of a bag; of a table none."""
    return () if is_table(path) else bag_contents(path, settings)


def read_all_joints(
    path: Path,
    topics: tuple[Topic, ...],
    *,
    joints: Sequence[str] | None = None,
    topic: str | None = None,
    columns: ColumnSettings | None = None,
    show: Callable[[TablePlan], None] | None = None,
    settings: ReadSettings = DEFAULT,
) -> Recording:
    """
    Read a recording without a robot.

    Parameters
    ----------
    path : Path
        A bag or a table.
    topics : tuple of Topic
        Topics of the bag.
    joints, topic : optional
        Which joints, by default all of the topic or table; and which topic, by default the one
        with the most messages.
    columns, show, settings : optional
        What is known of a table and of units; is given how a table is read; how a bag is read.

    Raises
    ------
    RecordingError
        There is no such topic, or joints have to be named.

    """
    said = columns or ColumnSettings()
    if is_table(path):
        settled = plan(open_table(path, episode=said.episode), said, joints)
        if show is not None:
            show(settled)
        return measured(settled)
    if joints is None:
        there = [one for one in topics if one.joints]
        if topic is not None:
            there = [one for one in there if one.name.lstrip('/') == topic.lstrip('/')]
        if not there:
            known = ', '.join(f'{t.name} ({t.type_name}, {t.count} messages)' for t in topics)
            named = f'{topic} of ' if topic else 'topic of '
            raise RecordingError(
                f'{path}: no {named}{JOINT_STATE}; there are {known or "no topics"}'
            )
        chosen = max(there, key=lambda one: one.count)
        topic, joints = chosen.name, chosen.joints
    return read_anything(path, joints=list(joints), topic=topic, columns=said, settings=settings)


def _settings(columns: dict[str, Any]) -> ColumnSettings:
    said = dict(columns)
    if isinstance(said.get('rename'), dict):
        said['rename'] = tuple(said['rename'].items())
    for name in ('position_scale', 'effort_scale', 'zero', 'gear'):
        value = said.get(name)
        if value is not None:
            listed = numbers(value) if isinstance(value, str) else np.atleast_1d(value).tolist()
            said[name] = tuple(listed)
    try:
        return ColumnSettings(**said)
    except TypeError as error:
        known = ', '.join(ColumnSettings.__dataclass_fields__)
        raise RecordingError(f'{str(error).split(" ", 1)[1]}; columns take {known}') from None
