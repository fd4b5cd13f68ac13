# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Paths in joint space that are clear of all bodies: straight where that is possible.

Where it is not, two trees of straight lines grow from both ends until they meet.
Source: Kuffner and LaValle 2000, RRT-Connect.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.geometry.clearance import Approach, ClearanceModel
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots.robot import UNLIMITED_HALF_RANGE
import numpy as np

#: Longest straight line of a tree, and the interval with which the proof of one begins
#: [rad or m].
_STEP, _INTERVAL = 0.6, 0.1
#: Poses that are drawn before it is said that there is no way.
_DRAWS = 800
#: Corners that are tried to cut of a path that was found.
_CUTS = 60

#: Whether poses of shape (N, n) may be held.
Held = Callable[[FloatArray], bool]
#: Whether the straight line between two poses, shape (n,), may be taken.
_Free = Callable[[FloatArray, FloatArray], bool]


def find_path(
    clearance: ClearanceModel | None,
    margin: float,
    ends: tuple[FloatArray, FloatArray],
    limits: tuple[FloatArray, FloatArray],
    held: Held,
    rng: np.random.Generator,
) -> FloatArray:
    """
    Find a path from pose to pose.

    Parameters
    ----------
    clearance : ClearanceModel or None
        Bodies to keep apart.
    margin : float
        Clearance to keep [m].
    ends : tuple of ndarray, shape (n,)
        Where it begins and where it ends [rad or m].
    limits : tuple of ndarray, shape (n,)
        Least and largest positions [rad or m].
    held : callable
        Whether the arm can hold poses.
    rng : Generator
        Source of randomness.

    Returns
    -------
    ndarray, shape (K, n)
        Poses with straight lines between them.

    Raises
    ------
    TrajectoryError
        If none was found; says what is in the straight way.

    """
    start, goal = ends

    def free(first: FloatArray, second: FloatArray) -> bool:
        count = int(np.ceil(np.abs(second - first).max() / _INTERVAL)) + 1
        poses = np.linspace(first, second, count + 1)
        return held(poses) and clear_line(clearance, margin, first, second) is None

    if free(start, goal):
        return np.vstack([start, goal])
    lower = np.maximum(limits[0], np.minimum(start, goal) - UNLIMITED_HALF_RANGE)
    upper = np.minimum(limits[1], np.maximum(start, goal) + UNLIMITED_HALF_RANGE)
    near, far = _Tree([start], free), _Tree([goal], free)
    for number in range(_DRAWS):
        reached = near.grow(rng.uniform(lower, upper))
        if reached is not None and far.connect(near.poses[reached]):
            path = [*near.branch(reached)[::-1], *far.branch(len(far.poses) - 1)[1:]]
            path = path if number % 2 == 0 else path[::-1]
            return np.array(_shortened(path, free, rng))
        near, far = far, near
    blocked = clear_line(clearance, margin, start, goal)
    reason = 'some pose on the straight one is too heavy to hold'
    if blocked is not None:
        reason = (
            f'on the straight one {blocked.first} and {blocked.second} come within '
            f'{blocked.distance:.4f} m'
        )
    raise TrajectoryError(f'no way to the trajectory was found: {reason}')


def clear_line(
    clearance: ClearanceModel | None, margin: float, start: FloatArray, goal: FloatArray
) -> Approach | None:
    """Prove that a straight line between two poses, shape (n,), is clear, or show where not."""
    if clearance is None:
        return None
    way = goal - start
    count = int(np.ceil(np.abs(way).max() / _INTERVAL)) + 1

    def path(share: FloatArray) -> Motion:
        q = start + share[:, np.newaxis] * way
        dq = np.broadcast_to(way, q.shape)
        return Motion(clearance.collision.robot.joints, share, q, dq, np.zeros_like(q))

    times = np.linspace(0.0, 1.0, count + 1)
    return clearance.first_fault(path, np.zeros(len(way)), times, margin)


@dataclass
class _Tree:
    """Poses that are joined by clear straight lines, from a root on."""

    poses: list[FloatArray]
    free: _Free
    parents: list[int] = field(default_factory=lambda: [-1])

    def grow(self, target: FloatArray) -> int | None:
        """Take a step towards a pose from the nearest one; return what was reached."""
        nearest = int(np.argmin([np.linalg.norm(target - q) for q in self.poses]))
        way = target - self.poses[nearest]
        reach = float(np.abs(way).max())
        if not reach > 0.0:
            return nearest
        step = target if reach <= _STEP else self.poses[nearest] + way * (_STEP / reach)
        if not self.free(self.poses[nearest], step):
            return None
        self.poses.append(step)
        self.parents.append(nearest)
        return len(self.poses) - 1

    def connect(self, target: FloatArray) -> bool:
        """Step towards a pose until it is reached, and say whether it is."""
        while True:
            reached = self.grow(target)
            if reached is None:
                return False
            if np.array_equal(self.poses[reached], target):
                if reached != len(self.poses) - 1:
                    self.poses.append(target)
                    self.parents.append(reached)
                return True

    def branch(self, number: int) -> list[FloatArray]:
        """Return the poses from one of them back to the root."""
        poses = []
        while number >= 0:
            poses.append(self.poses[number])
            number = self.parents[number]
        return poses


def _shortened(path: list[FloatArray], free: _Free, rng: np.random.Generator) -> list[FloatArray]:
    """Cut corners at random, and leave out poses that a straight line gets past."""
    path = _skipped(path, free)
    for _ in range(_CUTS if len(path) > 2 else 0):
        i, j = np.sort(rng.integers(0, len(path) - 1, 2))
        if i == j:
            continue
        first = path[i] + rng.random() * (path[i + 1] - path[i])
        second = path[j] + rng.random() * (path[j + 1] - path[j])
        if free(first, second):
            path = [*path[: i + 1], first, second, *path[j + 1 :]]
    return _skipped(path, free)


def _skipped(path: list[FloatArray], free: _Free) -> list[FloatArray]:
    """Go from each pose to the farthest one that a straight line leads to."""
    short, here = [path[0]], 0
    while here < len(path) - 1:
        here = next(
            there
            for there in range(len(path) - 1, here, -1)
            if there == here + 1 or free(path[here], path[there])
        )
        short.append(path[here])
    return short
