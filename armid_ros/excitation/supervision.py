# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where an arm is while it runs, whether it follows, and how it is brought to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
from typing import Protocol

from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: A joint that is slower is at rest [rad/s or m/s], and for how long it is looked at [s].
AT_REST, LOOK = 0.02, 0.1
#: How long a controller may take to begin with a trajectory that slows the arm down [s].
HANDOVER = 0.05
#: Time that a set point has to get somewhere, in units of what it takes at the velocity limit: a
#: quintic is 1.875 times as fast as its mean, and the rest is for the speed that it comes with.
_CATCHING = 3.0


class Path(Protocol):
    """What an arm follows: a `Run`, an `Excitation` or a `Transfer`."""

    def at(self, t: npt.ArrayLike) -> Motion:
        """Evaluate it at times [s]."""


@dataclass(frozen=True)
class MeasuredPose:
    """
    Where the joints of an arm were measured to be, whoever published them.

    Attributes
    ----------
    joints : tuple of str
        n joint names.
    q : ndarray, shape (n,)
        Latest positions [rad or m]; NaN where none came.
    seen : ndarray, shape (n,)
        When each of them came [s]; minus infinity where none came.
    stamps : tuple of int
        Their stamps [ns]; a stamp that comes again is no news.

    """

    joints: tuple[str, ...]
    q: FloatArray
    seen: FloatArray
    stamps: tuple[int, ...]

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, 'q', read_only(self.q))
        object.__setattr__(self, 'seen', read_only(self.seen))

    @classmethod
    def unknown(cls, joints: tuple[str, ...]) -> MeasuredPose:
        """Return the pose of an arm that was not heard of yet."""
        n = len(joints)
        return cls(joints, np.full(n, np.nan), np.full(n, -np.inf), (0,) * n)

    def updated(
        self, names: Sequence[str], positions: Sequence[float], stamp_ns: int, now: float
    ) -> MeasuredPose:
        """
        Take a message into account.

        Parameters
        ----------
        names : sequence of str
            Joints that it names, in any order; others than the arm's are passed over.
        positions : sequence of float
            Their positions [rad or m]; those that are no numbers are passed over.
        stamp_ns : int
            Its stamp [ns]; 0 where it has none.
        now : float
            When it came [s].

        """
        q, seen, stamps = self.q.copy(), self.seen.copy(), list(self.stamps)
        for name, position in zip(names, positions, strict=False):
            if name not in self.joints or not math.isfinite(position):
                continue
            j = self.joints.index(name)
            if stamp_ns and stamp_ns == stamps[j]:
                continue
            q[j], seen[j], stamps[j] = position, now, stamp_ns
        return replace(self, q=q, seen=seen, stamps=tuple(stamps))

    def staleness(self, now: float, timeout: float) -> str:
        """Say which joint was not heard of for longer than a timeout [s]; empty when none."""
        age = now - self.seen
        oldest = int(np.argmax(age))
        if age[oldest] <= timeout:
            return ''
        joint = self.joints[oldest]
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
    """Say which joint is how far from where it should be, each (n,); empty within tolerance."""
    error = measured - wanted
    worst = int(np.argmax(np.abs(error)))
    if abs(error[worst]) <= tolerance:
        return ''
    return (
        f"joint '{joints[worst]}' is {error[worst]:.3g} {units[worst]} from where it should be, "
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
    Say which joint would jump, and how far, if a trajectory began now.

    Parameters
    ----------
    joints : sequence of str
        n joint names.
    first : tuple of float and ndarray, shape (n,)
        Time [s] and positions [rad or m] of its first waypoint.
    measured : ndarray, shape (n,)
        Where the arm is [rad or m].
    fastest : ndarray, shape (n,)
        Largest velocity on the way to a first waypoint later than time 0 [rad/s or m/s].
    tolerance : float
        How far the arm may be from a first waypoint at time 0 [rad or m].

    Returns
    -------
    str
        Empty when nothing jumps.

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
    Return the way to rest from somewhere on a path, along the path itself.

    Parameters
    ----------
    path : Run, Excitation or Transfer
        What is left of it.
    phase : float
        Where it is, time since its start [s].
    duration : float
        Time to come to rest [s].
    rate : float
        Samples per second [Hz].

    Returns
    -------
    Motion
        From the handover on; the speed along the path falls from 1 to 0 as half a cosine.

    """
    count = int(np.ceil(duration * rate)) + 1
    t = np.linspace(min(HANDOVER, duration / 2.0), duration, count)
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


def held(joints: tuple[str, ...], q: FloatArray, duration: float) -> Motion:
    """
    Return the motion of an arm that stays where it is.

    Parameters
    ----------
    joints : tuple of str
        n joint names.
    q : ndarray, shape (n,)
        Where it is [rad or m].
    duration : float
        How long [s].

    """
    t = np.array([min(HANDOVER, duration / 2.0), duration])
    still = np.zeros((2, len(joints)))
    return Motion(joints, t, np.vstack([q, q]), still, still)


@dataclass(frozen=True)
class Speedometer:
    """
    How fast the joints of an arm are, from where they were a moment ago.

    Attributes
    ----------
    seen : float
        When the arm was looked at last [s]; minus infinity before.
    q : ndarray, shape (n,)
        Where it was then [rad or m].
    velocity : ndarray, shape (n,)
        Mean velocity since the look before [rad/s or m/s]; 0 while none is known.

    """

    seen: float
    q: FloatArray
    velocity: FloatArray

    @classmethod
    def unknown(cls, n_joints: int) -> Speedometer:
        """Return that of an arm that was not looked at yet."""
        return cls(-math.inf, np.full(n_joints, np.nan), np.zeros(n_joints))

    def looked(self, now: float, q: FloatArray) -> Speedometer:
        """Look at the arm, where it is long enough since it was looked at last."""
        if now - self.seen < LOOK:
            return self
        return Speedometer(now, q, np.nan_to_num((q - self.q) / (now - self.seen)))

    def fault(self, joints: Sequence[str], units: Sequence[str]) -> str:
        """Say which joint moves, and how fast; empty when all are at rest."""
        speed = np.abs(self.velocity)
        fastest = int(np.argmax(speed))
        if speed[fastest] < AT_REST:
            return ''
        return f"joint '{joints[fastest]}' moves at {speed[fastest]:.2g} {units[fastest]}/s"


@dataclass(frozen=True)
class Halt:
    """
    An arm that was told to stop, and by when it has to be at rest.

    Attributes
    ----------
    by : float
        When it has to be at rest [s].
    asked : int
        How often it was told to stop.
    seen : float
        When it was looked at last [s]; minus infinity before.
    q : ndarray, shape (n,)
        Where it was then [rad or m].

    """

    by: float
    asked: int
    seen: float
    q: FloatArray

    def looked(self, now: float, q: FloatArray) -> tuple[Halt, bool | None]:
        """
        Look at the arm.

        Returns
        -------
        Halt
            To look at next time.
        bool or None
            Whether it is at rest; None where it is too early to say.

        """
        if now < self.by or now - self.seen < LOOK:
            return self, None
        if not np.isfinite(self.seen):
            return replace(self, seen=now, q=q), None
        speed = np.abs(q - self.q).max() / (now - self.seen)
        return replace(self, seen=now, q=q), bool(speed < AT_REST)


def brought_to_rest(
    now: Motion,
    measured: FloatArray,
    velocity: FloatArray,
    robot: Robot,
    duration: float,
    rate: float,
) -> Motion:
    """
    Return the way to rest of an arm that does not follow, from where it was measured.

    A controller begins with it where the arm is, or where its set point is. The first point is
    where the arm is by then, so that the one has nothing to make up, and late enough for the set
    point of the other to get there.

    Parameters
    ----------
    now : Motion
        What the arm should do, one sample.
    measured : ndarray, shape (n,)
        Where it is [rad or m].
    velocity : ndarray, shape (n,)
        How fast it was measured to be [rad/s or m/s]. A joint is taken to be no faster than it
        should be, and not to go the other way: what is blocked stays where it is.
    robot : Robot
        Gives the limits.
    duration : float
        Time to come to rest [s].
    rate : float
        Samples per second [Hz].

    Returns
    -------
    Motion
        The speed of each joint falls to 0 as half a cosine.

    """
    asked = now.dq[0]
    speed = np.minimum(np.maximum(velocity * np.sign(asked), 0.0), np.abs(asked))
    room = np.where(asked > 0.0, robot.upper - measured, measured - robot.lower)
    speed = np.minimum(speed, 2.0 * np.maximum(room, 0.0) / duration) * np.sign(asked)
    lead = float(np.max(_CATCHING * np.abs(measured - now.q[0]) / robot.velocity_limit))
    lead = max(lead, min(HANDOVER, duration / 2.0))
    end = max(duration, lead + HANDOVER)
    t = np.linspace(lead, end, int(np.ceil((end - lead) * rate)) + 1)
    moved = np.minimum(t, duration)[:, np.newaxis]
    x = np.pi * moved / duration
    return Motion(
        now.joints,
        t,
        measured + speed * (moved + np.sin(x) * duration / np.pi) / 2.0,
        speed * (1.0 + np.cos(x)) / 2.0,
        speed * -np.pi * np.sin(x) / (2.0 * duration),
    )
