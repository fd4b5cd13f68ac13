# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bags of arms that are measured on both sides of their transmissions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from armid_ros.motion import ElasticRun
from armid_ros.recording.imu import imu_topic, LINK, MOTOR, REFERENCE, write_accelerations
from armid_ros.recording.joint_state.encoder import write_joint_states
from armid_ros.recording.message_types import STRING
from armid_ros.recording.qos import LATCHED
from armid_ros.recording.string_message import string_cdr
from armid_ros.recording.writer import whole_bag
from armid_ros.robots import Robot
import numpy as np

if TYPE_CHECKING:
    from armid_ros.simulation.accelerometers import LinkAccelerometers

_PAUSE_NS = 10**9


def write_runs(
    path: str | Path, runs: Sequence[ElasticRun], robot: Robot, sensors: LinkAccelerometers
) -> None:
    """
    Write experiments with any arm to a bag, one after the other with a pause of 1 s.

    Raises
    ------
    RecordingError
        The bag exists already.

    """
    joints = robot.joints
    with whole_bag(path) as writer:
        writer.add_topic('/robot_description', STRING, qos=[LATCHED])
        writer.write('/robot_description', string_cdr(robot.urdf), _PAUSE_NS)
        start = _PAUSE_NS
        for run in runs:
            motor, link = run.motor, run.link
            stamps = start + np.rint((motor.t - motor.t[0]) * 1e9).astype(np.int64)
            dt = float(np.median(np.diff(motor.t)))
            asked = motor.q[0] + dt * np.cumsum(run.reference, axis=0)
            write_joint_states(writer, MOTOR, joints, stamps, motor.q, motor.dq, motor.tau)
            write_joint_states(writer, LINK, joints, stamps, link.q, link.dq)
            write_joint_states(writer, REFERENCE, joints, stamps, asked, run.reference)
            felt = sensors.readings(link) if run.felt is None else run.felt
            for name, values in zip(robot.links, felt, strict=True):
                write_accelerations(writer, imu_topic(name), name, stamps, values)
            start = int(stamps[-1]) + _PAUSE_NS
