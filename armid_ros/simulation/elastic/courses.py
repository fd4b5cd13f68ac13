# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories that identify elastic joints: multisines during moves, and steps of velocity."""

from __future__ import annotations

from collections.abc import Callable

from armid_ros.errors import TrajectoryError
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
from armid_ros.simulation.reference import Reference
import numpy as np
import numpy.typing as npt

#: Frequency band of the multisines [Hz], and their samples per second.
_BAND, _RATE = (2.0, 100.0), 500.0
#: Shortest duration of an experiment, pause between two experiments, and duration of a step [s].
_EXPERIMENT, _STAND, _STEP = 4.0, 1.0, 0.5
#: Largest distance of a joint from its middle position [rad or m].
_REACH = np.pi / 3.0
#: Share of the velocity limits that a move to another pose uses during a multisine.
_WAY = 0.25
#: Number of poses tried before a TrajectoryError is raised.
_TRIES = 1000

#: Function that returns whether a path, shape (N, n), is allowed.
Clear = Callable[[FloatArray], bool]


def multisine(
    count: int,
    dt: float,
    band: tuple[float, float],
    rms: npt.ArrayLike,
    rng: np.random.Generator,
) -> FloatArray:
    """
    Return one period of sines of equal amplitude and random phase at every frequency of a band.

    Parameters
    ----------
    count : int
        Samples of the period.
    dt : float
        Time between samples [s].
    band : tuple of float
        Lowest and highest frequency [Hz].
    rms : array_like, shape (n,)
        Root mean square of each signal.
    rng : numpy.random.Generator
        Source of the phases.

    Returns
    -------
    ndarray, shape (count, n)

    """
    size = np.asarray(rms, dtype=float)
    frequency = np.fft.rfftfreq(count, dt)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    spectrum = np.zeros((len(frequency), len(size)), dtype=complex)
    spectrum[inside] = np.exp(2j * np.pi * rng.random((int(inside.sum()), len(size))))
    signal = np.fft.irfft(spectrum, count, axis=0)
    return np.asarray(size * signal / np.sqrt(np.mean(signal**2, axis=0)))


def multisine_course(
    robot: Robot, duration: float, torque: float, rng: np.random.Generator, clear: Clear
) -> Reference:
    """
    Return moves from pose to pose, each with a multisine of torque added.

    Friction keeps its sign during a move. The arm rests between two moves.

    Parameters
    ----------
    robot : Robot
        Robot with the limits.
    duration : float
        Largest duration of the trajectory [s].
    torque : float
        Root mean square of the multisine, as a share of the torque limits.
    rng : numpy.random.Generator
        Source of poses and phases.
    clear : callable
        Function that returns whether a path from pose to pose is allowed.

    Raises
    ------
    TrajectoryError
        If a limit is unknown, the duration is too short for one move, or no pose can be reached.

    """
    limit = _finite(robot, robot.torque_limit, 'torque')
    velocity = _finite(robot, robot.velocity_limit, 'velocity')
    here, parts, stand = robot.middle_pose, [], round(_STAND * _RATE)
    still = np.zeros((stand, robot.n_joints))
    samples = stand
    while True:
        there = _next_pose(robot, here, rng, clear, np.zeros(robot.n_joints))
        needed = float(np.max(1.875 * np.abs(there - here) / (_WAY * velocity)))
        count = round(max(_EXPERIMENT, needed) * _RATE)
        samples += count + stand
        if samples > duration * _RATE:
            break
        x = np.arange(count)[:, np.newaxis] / count
        q = here + (there - here) * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        on_top = np.minimum(1.0, np.minimum(x, 1.0 - x) / 0.05)
        tau = on_top * multisine(count, 1.0 / _RATE, _BAND, torque * limit, rng)
        parts.append((np.vstack([still + here, q]), np.vstack([still, tau])))
        here = there
    if not parts:
        raise TrajectoryError(
            f'duration {duration:g} s: one experiment alone takes {samples / _RATE:.3g} s'
        )
    q = np.vstack([*(part[0] for part in parts), still + here])
    tau = np.vstack([*(part[1] for part in parts), still])
    dq = np.gradient(q, 1.0 / _RATE, axis=0)
    return Reference(robot.joints, np.arange(len(q)) / _RATE, q, dq, None, tau)


def step_course(
    robot: Robot, duration: float, velocity: float, rng: np.random.Generator, clear: Clear
) -> Reference:
    """
    Return steps of velocity from rest in many poses, of single joints and of all joints.

    Parameters
    ----------
    robot : Robot
        Robot with the limits.
    duration : float
        Largest duration of the trajectory [s].
    velocity : float
        Velocity of the steps, as a share of the velocity limits.
    rng : numpy.random.Generator
        Source of the poses.
    clear : callable
        Function that returns whether a path from pose to pose is allowed.

    Raises
    ------
    TrajectoryError
        If a limit is unknown, the duration is too short for one step, or no pose can be reached.

    """
    limit = _finite(robot, robot.velocity_limit, 'velocity')
    n = robot.n_joints
    directions = [*np.eye(n), np.ones(n), (-1.0) ** np.arange(n)]
    t, q, number = [0.0, _STAND], [robot.middle_pose] * 2, 0
    while True:
        step = velocity * limit * directions[number % len(directions)] * _STEP
        there = _next_pose(robot, q[-1], rng, clear, step)
        way = float(np.max(np.abs(there - q[-1]) / (velocity * limit)))
        times = t[-1] + np.cumsum([way, _STAND, _STEP, _STAND])
        if times[-1] > duration:
            break
        t += times.tolist()
        q += [there, there, there + step, there + step]
        number += 1
    if not number:
        raise TrajectoryError(f'duration {duration:g} s: one step alone takes {times[-1]:.3g} s')
    return Reference(robot.joints, np.array(t), np.array(q))


def _next_pose(
    robot: Robot, here: FloatArray, rng: np.random.Generator, clear: Clear, beyond: FloatArray
) -> FloatArray:
    """Draw a pose that can be reached in a straight line, with a margin beyond the pose."""
    middle = robot.middle_pose
    lower = np.maximum(robot.lower, middle - _REACH)
    upper = np.minimum(robot.upper, middle + _REACH)
    room = 0.1 * (upper - lower)
    for _ in range(_TRIES):
        there = rng.uniform(lower + room, upper - room)
        if clear(np.vstack([np.linspace(here, there, 50), there + beyond])):
            return np.asarray(there)
    raise TrajectoryError(
        f'{robot.name}: none of {_TRIES} poses can be reached from the middle of the ranges in a '
        'straight line without bodies coming too near each other'
    )


def _finite(robot: Robot, limit: FloatArray, what: str) -> FloatArray:
    for joint, value in zip(robot.joints, limit, strict=True):
        if not np.isfinite(value):
            raise TrajectoryError(
                f'joint {joint}: the description has no {what} limit to take a share of'
            )
    return limit
