# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Supervision of a running arm: measured pose, tracking error, stop, and a slow rehearsal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from armid_ros.arm import ArmModel
from armid_ros.motion import FloatArray, Motion
import numpy as np
import numpy.typing as npt

#: Largest delay of a controller before it begins a stop trajectory [s].
HANDOVER_TIME = 0.05


class Path(Protocol):
    """Interface of a path that an arm follows: a `Run`, an `Excitation` or a `Transfer`."""

    def at(self, t: npt.ArrayLike) -> Motion:
        """Return the motion on the path at given times [s]."""


def staleness(joints: Sequence[str], seen: FloatArray, now: float, timeout: float) -> str:
    """
    Return a message if the position of a joint is older than a timeout; otherwise empty.

    Parameters
    ----------
    joints : sequence of str
        n joint names.
    seen : ndarray, shape (n,)
        Arrival time of the latest position [s]; minus infinity if none was received.
    now, timeout : float
        Time, and largest age of a position [s].

    """
    age = now - seen
    oldest = int(np.argmax(age))
    if age[oldest] <= timeout:
        return ''
    joint = joints[oldest]
    if not np.isfinite(age[oldest]):
        return f"no position of joint '{joint}' was received"
    return (
        f"the last new position of joint '{joint}' came {age[oldest]:.2f} s ago, more than "
        f'{timeout:g} s'
    )


def tracking_fault(
    joints: Sequence[str],
    units: Sequence[str],
    wanted: FloatArray,
    measured: FloatArray,
    tolerance: float,
) -> str:
    """Return a message if a joint's tracking error exceeds a tolerance; otherwise empty."""
    error = measured - wanted
    worst = int(np.argmax(np.abs(error)))
    if abs(error[worst]) <= tolerance:
        return ''
    return (
        f"joint '{joints[worst]}' is {error[worst]:.3g} {units[worst]} from its planned position, "
        f'more than {tolerance:g} {units[worst]}'
    )


def jump_fault(
    joints: Sequence[str],
    first: tuple[float, FloatArray],
    measured: FloatArray,
    fastest: FloatArray,
    tolerance: float,
) -> str:
    """
    Return a message if a trajectory starts too far from the arm's present position.

    Parameters
    ----------
    joints : sequence of str
        n joint names.
    first : tuple of float and ndarray, shape (n,)
        Time [s] and positions [rad or m] of its first waypoint.
    measured : ndarray, shape (n,)
        Measured positions [rad or m].
    fastest : ndarray, shape (n,)
        Largest velocity of the move to a first waypoint later than time 0 [rad/s or m/s].
    tolerance : float
        Largest distance of the arm from a first waypoint at time 0 [rad or m].

    Returns
    -------
    str
        Message; empty if no joint jumps.

    """
    time, q = first
    allowed = tolerance + fastest * max(time, 0.0)
    distance = q - measured
    worst = int(np.argmax(np.abs(distance) / allowed))
    if abs(distance[worst]) <= allowed[worst]:
        return ''
    return (
        f"joint '{joints[worst]}' is at {measured[worst]:.4g} and would have to be at "
        f'{q[worst]:.4g} after {time:g} s: a jump of {distance[worst]:.4g}, and at most '
        f'{allowed[worst]:.3g} is allowed'
    )


def slowed(path: Path, phase: float, duration: float, rate: float) -> Motion:
    """
    Return a motion that follows a path from a given time on, and slows down to rest.

    Parameters
    ----------
    path : Run, Excitation or Transfer
        The path.
    phase : float
        Time since the start of the path [s].
    duration : float
        Time to come to rest [s].
    rate : float
        Samples per second [Hz].

    Returns
    -------
    Motion
        The stop from its first sample on; the speed along the path falls to 0 as half a cosine.

    """
    count = int(np.ceil(duration * rate)) + 1
    t = np.linspace(min(HANDOVER_TIME, duration / 2.0), duration, count)
    x = np.pi * t / duration
    motion = path.at(phase + (t + np.sin(x) * duration / np.pi) / 2.0)
    speed = ((1.0 + np.cos(x)) / 2.0)[:, np.newaxis]
    change = (-np.pi * np.sin(x) / (2.0 * duration))[:, np.newaxis]
    return Motion(
        motion.joints,
        t,
        motion.q,
        speed * motion.dq,
        speed**2 * motion.ddq + change * motion.dq,
    )


class Rehearsal:
    """
    Tracking errors and torques that are measured while an arm follows a path slowly.

    Parameters
    ----------
    path : Path
        The path to follow.
    arm : ArmModel
        Model for the torque prediction.

    Attributes
    ----------
    tracking : ndarray, shape (n,)
        Largest tracking error of each joint [rad or m].
    torque : ndarray, shape (n,)
        Largest measured torque [N m or N]; NaN if none was measured.

    """

    def __init__(self, path: Path, arm: ArmModel) -> None:
        self._path, self._arm = path, arm
        self.tracking, self.torque = np.full((2, arm.robot.n_joints), np.nan)
        self._count, self._until = 0, 0.0

    def add(self, phase: float, q: FloatArray, tau: FloatArray) -> None:
        """
        Add a measured joint state to the tracking errors and torques of the rehearsal.

        Parameters
        ----------
        phase : float
            Time since the start of the path [s].
        q, tau : ndarray, shape (n,)
            Measured position and torque; NaN if not measured.

        """
        distance = np.abs(q - self._path.at([phase]).q[0])
        self.tracking = np.fmax(self.tracking, distance)
        self.torque = np.fmax(self.torque, np.abs(tau))
        self._count, self._until = self._count + 1, max(self._until, phase)

    def predicted(self) -> FloatArray:
        """Return the largest predicted torque of each joint so far, shape (n,) [N m or N]."""
        wanted = self._path.at(np.linspace(0.0, self._until, 4000))
        return np.asarray(np.abs(self._arm.joint_torque(wanted)).max(axis=0))

    def report(self) -> tuple[str, tuple[str, ...]]:
        """Return a summary, and a sentence on each joint with more torque than predicted."""
        if not self._count:
            fault = 'no joint state was received during the rehearsal'
            return fault, (fault,)
        robot, predicted = self._arm.robot, self.predicted()
        surprises: list[str] = []
        for j, joint in enumerate(robot.joints):
            limit = robot.torque_limit[j]
            room = max(predicted[j], 0.05 * limit if np.isfinite(limit) else 0.0)
            # largest accepted ratio of a measured torque to the largest predicted torque. The
            # ratio is large because descriptions lack friction, which dominates the torque of a
            # slow arm.
            if self.torque[j] > 3.0 * room > 0.0:
                surprises.append(
                    f'the torque of {joint} was {self.torque[j]:.3g} {robot.torque_units[j]}, '
                    f'{predicted[j]:.3g} predicted'
                )
        worst = int(np.argmax(self.tracking))
        text = f'tracking error at most {self.tracking[worst]:.3g} ({robot.joints[worst]})'
        if np.isfinite(self.torque).any():
            limits = np.where(robot.torque_limit > 0.0, robot.torque_limit, np.inf)
            most = int(np.nanargmax(self.torque / limits))
            text += f'; largest torque {self.torque[most]:.3g} {robot.torque_units[most]} '
            text += f'({robot.joints[most]}), {predicted[most]:.3g} predicted'
        return '; '.join((text, *surprises)), tuple(surprises)
