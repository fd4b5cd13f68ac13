# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Reader of bags with motor, link and reference motion of arms with elastic joints.

/joint_states (or /motor/joint_states) has positions, velocities and torques of the motors,
converted to the joint side. /link/joint_states has positions and velocities of the links, and
/reference/joint_states the reference velocities of the loops. An Imu topic per link has the
accelerometer on the axis of the link, x outwards and y sideways. An experiment has nonzero
reference velocity; rest or a pause in the timestamps ends it.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.motion import ElasticRun, FloatArray, Motion
from armid_ros.recording import read_recording, Recording, topics
from armid_ros.recording.elastic import imu_topic, LINK, MOTOR, read_accelerations, REFERENCE
from armid_ros.recording.source import DEFAULT, ReadSettings
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Alternative topic of the motors.
_OTHER_MOTOR = '/motor/joint_states'
#: Length of the shortest experiment [s].
_MIN_DURATION = 0.2


def read_runs(
    path: str | Path,
    robot: Robot,
    radius: npt.ArrayLike,
    settings: ReadSettings = DEFAULT,
    read: Callable[..., None] | None = None,
) -> list[ElasticRun]:
    """
    Read all experiments with a two-link arm from a bag.

    Parameters
    ----------
    path : str or Path
        The bag.
    robot : Robot
        A planar pair of links.
    radius : array_like, shape (2,)
        Distance of each link's accelerometer from the axis of its joint [m].
    settings : ReadSettings
        Checksums and memory.
    read : callable, optional
        Callback with the recordings of joint states.

    Raises
    ------
    RecordingError
        If a topic or quantity is missing, the samples of two topics have different timestamps, or
        the reference velocity is always zero.

    """
    motors = _motor_topic(path, settings)
    names = (motors, LINK, REFERENCE)
    recordings = [
        read_recording(path, joints=robot.joints, topic=topic, settings=settings)
        for topic in names
    ]
    readings = [read_accelerations(path, imu_topic(name), settings) for name in robot.links]
    if read is not None:
        read(*recordings)
    if recordings[0].tau is None or any(recording.dq is None for recording in recordings):
        raise RecordingError(
            f'{path}: velocities of {motors}, {LINK} and {REFERENCE}, and efforts of {motors}, '
            'are needed, but at least one was not recorded'
        )
    stamps = [  # [us]
        *(np.rint(r.start_ns / 1000 + r.t * 1e6).astype(int) for r in recordings),
        *(np.rint(f[0] / 1000).astype(int) for f in readings),
    ]
    common = _common(path, (*names, *map(imu_topic, robot.links)), stamps)
    places = [np.intersect1d(own, common, return_indices=True)[1] for own in stamps]
    motor, link, reference = (r.select(k) for r, k in zip(recordings, places, strict=False))
    sideways = [values[k, 1] for (_, values), k in zip(readings, places[3:], strict=True)]
    assert motor.dq is not None and motor.tau is not None
    assert link.dq is not None and reference.dq is not None
    ddq = _accelerations(robot, np.asarray(radius, dtype=float), link.q, link.dq, sideways)
    period = float(np.median(np.diff(motor.t)))
    lag = reference.q - motor.q
    runs = []
    for rest, start, stop in _experiments(motor.t, np.any(reference.dq != 0.0, axis=1), period):  # noqa: RUF069 - as commanded
        rows = slice(start, stop)
        t = np.asarray(period * np.arange(stop - start), dtype=np.float64)
        zero = np.zeros((stop - start, 2))
        runs.append(
            ElasticRun(
                Motion(robot.joints, t, motor.q[rows], motor.dq[rows], zero, motor.tau[rows]),
                Motion(robot.joints, t, link.q[rows], link.dq[rows], ddq[rows]),
                reference.dq[rows],
                lag[rest:start].mean(axis=0) if rest < start else np.zeros(2),
            )
        )
    if not runs:
        raise RecordingError(
            f'{path}: no motion of the topic {REFERENCE} lasts {_MIN_DURATION:g} s; record the '
            'reference of the velocity loops for longer'
        )
    return runs


def _accelerations(
    robot: Robot, radius: FloatArray, q: FloatArray, dq: FloatArray, sideways: Sequence[FloatArray]
) -> FloatArray:
    """Return joint accelerations, (N, 2) [rad/s^2], from sideways accelerations of links."""
    offset = np.asarray(robot.model.jointPlacements[2].translation)
    length = np.hypot(offset[0], offset[1])
    first = sideways[0] / radius[0]
    carried = length * (first * np.cos(q[:, 1]) + dq[:, 0] ** 2 * np.sin(q[:, 1]))
    return np.column_stack([first, (sideways[1] - carried) / radius[1] - first])


def read_sides(
    path: str | Path, robot: Robot, settings: ReadSettings = DEFAULT
) -> tuple[Recording, Recording]:
    """
    Read a bag; return a recording of the motors and a recording of the links.

    Raises
    ------
    RecordingError
        If a topic is missing.

    """
    motors = _motor_topic(path, settings)
    motor, link = (
        read_recording(path, joints=robot.joints, topic=topic, settings=settings)
        for topic in (motors, LINK)
    )
    return motor, link


def _motor_topic(path: str | Path, settings: ReadSettings) -> str:
    names = {topic.name for topic in topics(path, settings)}
    return _OTHER_MOTOR if _OTHER_MOTOR in names else MOTOR


def _experiments(
    t: FloatArray, moving: npt.NDArray[np.bool_], period: float
) -> list[tuple[int, int, int]]:
    """Return three sample indices of each experiment: start of rest, start and end of motion."""
    # time of rest between two experiments [s]
    pause, shortest = round(0.1 / period), round(_MIN_DURATION / period)
    found = []
    cuts = np.flatnonzero(np.diff(t) > 1.5 * period) + 1
    for rows in np.split(np.arange(len(t)), cuts):
        active = rows[moving[rows]]
        rest = int(rows[0])
        for part in np.split(active, np.flatnonzero(np.diff(active) > pause) + 1):
            if len(part) >= shortest:
                start = int(part[0])
                found.append((max(rest, start - pause), start, int(part[-1]) + 1))
            rest = int(part[-1]) + 1 if len(part) else rest
    return found


def _common(
    path: str | Path, names: Sequence[str], stamps: Sequence[npt.NDArray[np.int64]]
) -> npt.NDArray[np.int64]:
    """Return the time stamps [us] that all topics have; RecordingError for too few stamps."""
    common: npt.NDArray[np.int64] = reduce(np.intersect1d, stamps)
    # smallest share of samples with a common timestamp on all topics
    if len(common) < 0.9 * max(map(len, stamps)):
        counts = ', '.join(f'{name} ({len(s)})' for name, s in zip(names, stamps, strict=True))
        raise RecordingError(
            f'{path}: only {len(common)} timestamps are common to all of {counts}; use one '
            'timestamp for simultaneous measurements, and record all topics'
        )
    return common
