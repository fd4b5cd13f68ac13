# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Experiments with a two-link arm as bags.

/motor/joint_states has positions, velocities and torques of the motors as seen at the joints,
/link/joint_states positions and velocities of the links, /reference/joint_states what the velocity
loop was asked for, and an Imu topic per link the accelerometer on its axis, x outwards and y
sideways. A pause in the stamps ends an experiment.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import (
    BagWriter,
    LATCHED,
    read_recording,
    Recording,
    string_cdr,
    write_joint_states,
)
from armid_ros.recording.imu import read_accelerations, write_accelerations
from armid_ros.recording.message_types import STRING
from armid_ros.robots import Robot
from armid_ros.simulation.elastic_run import ElasticRun
import numpy as np
import numpy.typing as npt

MOTOR, LINK, REFERENCE = '/motor/joint_states', '/link/joint_states', '/reference/joint_states'
_PAUSE_NS = 10**9
_EARTH = 9.81


@dataclass(frozen=True, eq=False)
class Accelerometers:
    """
    Where the accelerometers of a planar two-link arm are.

    Attributes
    ----------
    radius : ndarray, shape (2,)
        Distance from the axis of each link's own joint [m].
    length : float
        From the first axis to the second [m].

    """

    radius: FloatArray
    length: float

    @classmethod
    def on(cls, robot: Robot, radius: npt.ArrayLike) -> Accelerometers:
        """Place accelerometers on a robot, at distances from the joints, shape (2,) [m]."""
        offset = np.asarray(robot.model.jointPlacements[2].translation)
        return cls(np.asarray(radius, dtype=float), float(np.hypot(offset[0], offset[1])))

    def readings(self, link: Motion) -> tuple[FloatArray, FloatArray]:
        """Return what the two of them read along a motion, each of shape (N, 3) [m/s^2]."""
        cosine, sine = np.cos(link.q[:, 1]), np.sin(link.q[:, 1])
        (v1, v2), (a1, a2) = link.dq.T, link.ddq.T
        first, second = self.radius
        up = np.full(len(link), _EARTH)
        inner = np.column_stack([-first * v1**2, first * a1, up])
        outwards = self.length * (a1 * sine - v1**2 * cosine) - second * (v1 + v2) ** 2
        sideways = self.length * (a1 * cosine + v1**2 * sine) + second * (a1 + a2)
        return inner, np.column_stack([outwards, sideways, up])

    def accelerations(
        self, q: FloatArray, dq: FloatArray, first: FloatArray, second: FloatArray
    ) -> FloatArray:
        """
        Return the angular accelerations of the joints, shape (N, 2) [rad/s^2].

        Parameters
        ----------
        q, dq : ndarray, shape (N, 2)
            Motion of the links.
        first, second : ndarray, shape (N, 3)
            Readings; those sideways count.

        """
        a1 = first[:, 1] / self.radius[0]
        carried = self.length * (a1 * np.cos(q[:, 1]) + dq[:, 0] ** 2 * np.sin(q[:, 1]))
        return np.column_stack([a1, (second[:, 1] - carried) / self.radius[1] - a1])


def write_runs(
    path: str | Path, runs: Sequence[ElasticRun], robot: Robot, sensors: Accelerometers
) -> None:
    """
    Write experiments to a bag, one after the other with a pause of 1 s.

    Raises
    ------
    RecordingError
        The bag exists already.

    """
    joints = robot.joints
    with BagWriter(path) as writer:
        writer.add_topic('/robot_description', STRING, qos=[LATCHED])
        writer.write('/robot_description', string_cdr(robot.urdf), _PAUSE_NS)
        start = _PAUSE_NS
        for run in runs:
            motor, link = run.motor, run.link
            stamps = start + np.rint((motor.t - motor.t[0]) * 1e9).astype(np.int64)
            dt = float(np.median(np.diff(motor.t)))
            asked = link.q[0] + dt * np.cumsum(run.reference, axis=0)
            write_joint_states(writer, MOTOR, joints, stamps, motor.q, motor.dq, motor.tau)
            write_joint_states(writer, LINK, joints, stamps, link.q, link.dq)
            write_joint_states(writer, REFERENCE, joints, stamps, asked, run.reference)
            for name, values in zip(robot.links, sensors.readings(link), strict=True):
                write_accelerations(writer, _imu(name), name, stamps, values)
            start = int(stamps[-1]) + _PAUSE_NS


def read_runs(path: str | Path, robot: Robot, sensors: Accelerometers) -> list[ElasticRun]:
    """
    Read the experiments of a bag.

    Raises
    ------
    RecordingError
        A topic or quantity is missing, or the samples of two topics are not of the same time.

    """
    motor, link, asked = (
        read_recording(path, joints=robot.joints, topic=topic)
        for topic in (MOTOR, LINK, REFERENCE)
    )
    first, second = (read_accelerations(path, _imu(name)) for name in robot.links)
    stamps = _stamps(motor)
    for other, topic in (
        (_stamps(link), LINK),
        (_stamps(asked), REFERENCE),
        (first[0], _imu(robot.links[0])),
        (second[0], _imu(robot.links[1])),
    ):
        if len(other) != len(stamps) or np.any(np.abs(other - stamps) > 1000):
            raise RecordingError(
                f'{path}: {topic} has {len(other)} samples and {MOTOR} {len(stamps)}, or not at '
                'the same times; record all topics with the same stamps'
            )
    if motor.dq is None or motor.tau is None or link.dq is None or asked.dq is None:
        raise RecordingError(
            f'{path}: velocities of {MOTOR}, {LINK} and {REFERENCE}, and torques of {MOTOR}, are '
            'needed; one of them was not recorded'
        )
    ddq = sensors.accelerations(link.q, link.dq, first[1], second[1])
    period = np.median(np.diff(motor.t))
    cuts = np.flatnonzero(np.diff(motor.t) > 5.0 * period) + 1
    runs = []
    for rows in np.split(np.arange(len(stamps)), cuts):
        t = period * np.arange(len(rows))
        zero = np.zeros((len(rows), 2))
        runs.append(
            ElasticRun(
                Motion(robot.joints, t, motor.q[rows], motor.dq[rows], zero, motor.tau[rows]),
                Motion(robot.joints, t, link.q[rows], link.dq[rows], ddq[rows]),
                asked.dq[rows],
            )
        )
    return runs


def _imu(link: str) -> str:
    return f'/{link}/imu'


def _stamps(recording: Recording) -> npt.NDArray[np.int64]:
    return np.asarray(recording.start_ns + np.rint(recording.t * 1e9), dtype=np.int64)
