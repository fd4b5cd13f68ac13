# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Samples that no arm can have given: torques far out of the rest, positions that jump."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.rows.signals import GAP_PERIODS
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: The middle of a recording that tells what is usual of it, in percent.
_USUAL = (1.0, 99.0)


@dataclass(frozen=True)
class FaultySamples:
    """
    What is faulty in a recording.

    Attributes
    ----------
    first : str
        The first of them, in words.
    count : int
        How many.
    sound : ndarray of bool, shape (N,)
        What is left without them; around a jump so much is missing that filters do not bridge it.

    """

    first: str
    count: int
    sound: npt.NDArray[np.bool_]


def faulty_samples(robot: Robot, recording: Recording) -> FaultySamples | None:
    """Find the samples of a recording of a robot that cannot be; None where there are none."""
    assert recording.tau is not None
    # where torques are further from what is usual than that spans, many times
    lower, upper = np.percentile(recording.tau, _USUAL, axis=0)
    excess = np.maximum(lower - recording.tau, recording.tau - upper)
    torque = np.asarray((excess > LIMITS.jump * (upper - lower)) & (upper > lower))
    # where positions have stepped faster than the joint ever moves, many times
    position = np.zeros(recording.q.shape, dtype=bool)
    if len(recording) > 1:
        time = np.maximum(np.diff(recording.t), recording.period)
        speed = np.abs(np.diff(recording.q, axis=0)) / time[:, np.newaxis]
        usual = np.percentile(speed, _USUAL[1], axis=0)
        position[1:] = (speed > LIMITS.jump * usual) & (usual > 0.0)
    at = np.argwhere(torque | position)
    if not len(at):
        return None
    row, joint = at[0]
    sound: npt.NDArray[np.bool_] = np.logical_not(torque.any(axis=1))
    width = int(GAP_PERIODS) + 1
    for jump in np.flatnonzero(position.any(axis=1)):
        sound[max(0, jump - width) : jump + width] = False
    name, t = recording.joints[joint], recording.t[row]
    if torque[row, joint]:
        unit = robot.torque_units[joint]
        first = f'the torque of {name} is {recording.tau[row, joint]:.3g} {unit} at {t:.3f} s'
    else:
        step = recording.q[row, joint] - recording.q[row - 1, joint]
        unit = robot.position_units[joint]
        first = f'the position of {name} jumps by {step:.3g} {unit} at {t:.3f} s'
    return FaultySamples(first, len(np.unique(at[:, 0])), sound)
