# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Conversion of arguments of the public functions: names and paths to robots and recordings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from armid_ros.arm import ArmModel, load_model
from armid_ros.effects import make_effect, USUAL_EFFECTS
from armid_ros.errors import RecordingError, RobotError, TrajectoryError
from armid_ros.files.cells import parted
from armid_ros.identification import SignalSettings
from armid_ros.identification.rows.signals import conditioning, no_stretch, segments
from armid_ros.motion import Motion
from armid_ros.recording import reader, ReadSettings, Recording, Topic
from armid_ros.recording.columns import ColumnSettings, numbers
from armid_ros.recording.source import DEFAULT
from armid_ros.robots import joints_beside_arms, Robot, shipped_robots
from armid_ros.robots.load import shipped_path
import numpy as np

#: A robot, a model of its arm, a shipped name, or the path of a description or a model.yaml.
RobotLike = Robot | ArmModel | str | Path
#: A recording, or the path of a bag or a table.
RecordingLike = Recording | str | Path
#: A random generator, or a seed.
Rng = np.random.Generator | int
#: Callback; its arguments are the completed share of the work, and the name of a new step.
Progress = Callable[..., None]

#: One number or one per joint, also as text: '1798/7, 50'.
_Numbers = float | str | Sequence[float]

#: Effects that are fitted with the rigid body by default.
USUAL = ','.join(USUAL_EFFECTS)


def robot_of(robot: RobotLike) -> Robot:
    """Return a robot unchanged; convert a model, a shipped name or a path to a robot."""
    return arm_of(robot, effects='').robot


def is_model(path: str | Path) -> bool:
    """Return whether a path has the suffix of a model file, .yaml or .yml."""
    if not isinstance(path, str | Path):
        raise RobotError(
            f'the first argument is a {type(path).__name__}, not a robot; give the robot before '
            'the recordings'
        )
    return Path(path).suffix in ('.yaml', '.yml')


def source_of(robot: Robot) -> str:
    """Return the robot's name for result files: its shipped name, else its path or own name."""
    for name in shipped_robots():
        if robot.path == shipped_path(name):
            return name
    return robot.name if robot.path is None else str(Path(robot.path).resolve())


def arm_of(arm: RobotLike, effects: str = USUAL) -> ArmModel:
    """Return an arm model; a robot without a model gets `effects`, a comma-separated list."""
    if isinstance(arm, ArmModel):
        return arm
    if not isinstance(arm, Robot) and is_model(arm):
        return load_model(arm)
    return ArmModel.of(arm if isinstance(arm, Robot) else str(arm), effects=effects)


def with_effects(arm: ArmModel, names: str) -> ArmModel:
    """Return the arm with the effects of a comma-separated list added, without duplicates."""
    for name in filter(None, parted(names)):
        effect = make_effect(name, arm.robot)
        if (effect.name, effect.joints) not in [(own.name, own.joints) for own in arm.effects]:
            arm = arm.with_effect(effect)
    return arm


def drivable(arm: RobotLike) -> ArmModel:
    """Return an arm model; TrajectoryError if the robot has driven joints outside of its arms."""
    model = arm_of(arm)
    others = joints_beside_arms(model.robot) if isinstance(arm, str | Path) else ()
    if others:
        kept = ', '.join(repr(joint) for joint in model.robot.joints if joint not in others)
        raise TrajectoryError(
            f'{arm}: driven joints belong to no arm: {", ".join(others)}; choose the joints with '
            f'ar.load_robot({str(arm)!r}, joints=[{kept}])'
        )
    return model


def recordings_of(
    recordings: RecordingLike | Sequence[RecordingLike], robot: Robot, *, required: bool = False
) -> list[Recording]:
    """Return recordings as a list; read recordings that are given as paths."""
    several = recordings if isinstance(recordings, Iterable) else [recordings]
    several = [recordings] if isinstance(recordings, RecordingLike) else list(several)
    if required and not several:
        raise RecordingError('no recording was given: give at least one bag, table or Recording')
    for one in several:
        if not isinstance(one, RecordingLike):
            raise RecordingError(
                f'{str(one)[:40]!r} is not a recording; give a Recording, or the path of a bag or '
                'a table'
            )
    read = [one if isinstance(one, Recording) else read_recording(one, robot) for one in several]
    for recording in read:
        if recording.joints != robot.joints:
            raise RecordingError(
                f'{recording.source or "recording"}: the joints of the recording are '
                f'{", ".join(recording.joints)}, but the joints of {robot.name} are '
                f'{", ".join(robot.joints)}; read the recording with this robot'
            )
    return read


def with_unique_sources(*groups: list[Recording]) -> tuple[list[Recording], ...]:
    """Return recordings with numbers appended to equal source names, except file names."""
    taken: Counter[str] = Counter()
    named = [list(group) for group in groups]
    for group in named:
        for k, recording in enumerate(group):
            source = recording.source or 'recording'
            if Path(source).exists():  # a recording that is given twice is read only once
                continue
            taken[source] += 1
            number = f' {taken[source]}' if taken[source] > 1 else ''
            group[k] = replace(recording, source=f'{source}{number}')
    return tuple(named)


def motion_of(recording: Recording, cutoff: float | None = None) -> Motion:
    """Return the filtered motion of the longest gap-free section of a recording."""
    measured = recording.tau is not None
    taken = recording if measured else replace(recording, tau=np.zeros_like(recording.q))
    used = conditioning([taken], SignalSettings(cutoff))
    found = max(segments(taken, used), key=len, default=None)
    if found is None:
        raise no_stretch(recording, used)
    return found if measured else replace(found, tau=None)


def read_recording(
    path: str | Path,
    robot: RobotLike | Sequence[str] | None = None,
    *,
    topic: str | None = None,
    time: str | None = None,
    position: str | None = None,
    velocity: str | None = None,
    effort: str | None = None,
    temperature: str | None = None,
    time_unit: str | None = None,
    rate_hz: float | None = None,
    degrees: bool = False,
    position_scale: _Numbers = (),
    effort_scale: _Numbers = (),
    zero: _Numbers = (),
    gear: _Numbers = (),
    coupling: Sequence[tuple[str, str, float]] = (),
    rename: Mapping[str, str] | Sequence[tuple[str, str]] = (),
    episode: int | None = None,
) -> Recording:
    """
    Read the joints of a robot from a bag or a table.

    Parameters
    ----------
    path : str or Path
        A rosbag2 directory, .mcap, .db3, .bag, .csv, .npz, .mat, .parquet, or the folder of a
        LeRobot dataset.
    robot : robot, model, name, path, or sequence of str
        Robot whose joints are read, or names of joints. By default all joints of a table, of the
        only JointState topic of a bag, or of ``topic``.
    topic : str, optional
        JointState topic, where a bag has several.
    time, position, velocity, effort, temperature : str, optional
        Columns of a table: a name, names with commas, ``'q{}'`` for the joint's name or number;
        ``'[1..7]'`` for columns without names, counted from 0; ``'none'`` to skip the
        quantity (of a bag, only temperatures can be skipped). Guessed by default.
    time_unit : {'s', 'ms', 'us', 'ns'}, optional
        Unit of the column of time; guessed by default.
    rate_hz : float, optional
        Sample rate of a table without a column of time [Hz].
    degrees : bool
        Whether positions and velocities are in degrees.
    position_scale, effort_scale : float or sequence of float
        Factors to rad or m, and to N m or N: one, or one per joint. The factor of a current is
        the torque constant [N m/A].
    zero : float or sequence of float
        Offsets added to the converted positions [rad or m]: one, or one per joint.
    gear : float or sequence of float
        Turns of the motor per turn of the joint, if the values are those of the motors.
    coupling : sequence of (str, str, float)
        For coupled wrists: motor, other joint, and turns of the motor per turn of that joint.
    rename : mapping of str to str
        Beginnings of joint names in the file, and their replacements:
        ``{'fer_': 'panda_'}``.
    episode : int, optional
        Number of the episode of a LeRobot dataset.

    Returns
    -------
    Recording
        Joint positions, velocities and torques.

    Raises
    ------
    RecordingError
        The message has the file, the topic, joint, column or line, and the remedy.

    Examples
    --------
    >>> import armid_ros as ar
    >>> run = ar.read_recording('log.csv', 'my_arm.urdf', effort='amps_{}', effort_scale=4.0)
    >>> run.tau.shape == (len(run), 3)
    True

    """
    settings = ColumnSettings(
        time=time,
        position=position,
        velocity=velocity,
        effort=effort,
        temperature=temperature,
        time_unit=time_unit,
        rate_hz=rate_hz,
        degrees=degrees,
        position_scale=_numbers(position_scale),
        effort_scale=_numbers(effort_scale),
        zero=_numbers(zero),
        gear=_numbers(gear),
        coupling=tuple(coupling),
        rename=tuple(rename.items() if isinstance(rename, Mapping) else rename),
        episode=episode,
    )
    joints: tuple[str, ...] | None = None
    slides: list[bool] | None = None
    if robot is None:
        named = [one.name for one in topics_of(Path(path)) if one.joints]
        if topic is None and len(named) > 1:
            raise RecordingError(
                f'{path}: several topics contain JointState messages: {", ".join(named)}; choose '
                'one with topic='
            )
    elif isinstance(robot, (Robot, ArmModel, str, Path)):
        described = robot_of(robot)
        joints, slides = described.joints, [bool(one) for one in described.prismatic]
    else:
        joints = tuple(robot)
    return reader.read_recording(path, joints=joints, slides=slides, topic=topic, columns=settings)


def topics_of(path: Path, settings: ReadSettings = DEFAULT) -> tuple[Topic, ...]:
    """Return the topics of a bag; empty for a table."""
    return () if reader.is_table(path) else reader.topics(path, settings)


def _numbers(given: _Numbers) -> tuple[float, ...]:
    return numbers(given) if isinstance(given, str) else tuple(np.atleast_1d(given).tolist())
