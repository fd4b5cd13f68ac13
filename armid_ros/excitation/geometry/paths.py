# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Collision-free paths in joint space.

A path is a straight line if possible. Otherwise, two trees of straight lines grow from the ends
until they meet.
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

#: Initial interval of the proof of the clearance of a straight line [rad or m].
_PROOF_INTERVAL = 0.1

#: Callback: is the static torque of poses, (N, n), within the limits?
Held = Callable[[FloatArray], bool]
#: Callback: is the straight line between two poses, shape (n,), allowed?
_Free = Callable[[FloatArray, FloatArray], bool]


def find_path(
    clearance: ClearanceModel | None,
    ends: tuple[FloatArray, FloatArray],
    limits: tuple[FloatArray, FloatArray],
    held: Held,
    rng: np.random.Generator,
) -> FloatArray:
    """
    Find a collision-free path between two poses in joint space.

    Parameters
    ----------
    clearance : ClearanceModel or None
        Bodies to keep apart.
    ends : tuple of ndarray, shape (n,)
        First and last pose of the path [rad or m].
    limits : tuple of ndarray, shape (n,)
        Least and largest positions [rad or m].
    held : callable
        Function that returns whether the arm can hold poses.
    rng : Generator
        Source of randomness.

    Returns
    -------
    ndarray, shape (K, n)
        Poses with straight lines between them.

    Raises
    ------
    TrajectoryError
        If no path was found; the message names the obstruction of the straight path.

    """
    start, goal = ends

    def free(first: FloatArray, second: FloatArray) -> bool:
        count = int(np.ceil(np.abs(second - first).max() / _PROOF_INTERVAL)) + 1
        poses = np.linspace(first, second, count + 1)
        return held(poses) and clear_line(clearance, first, second) is None

    if free(start, goal):
        return np.vstack([start, goal])
    lower = np.maximum(limits[0], np.minimum(start, goal) - UNLIMITED_HALF_RANGE)
    upper = np.minimum(limits[1], np.maximum(start, goal) + UNLIMITED_HALF_RANGE)
    near, far = _Tree([start], free), _Tree([goal], free)
    # number of random poses before a TrajectoryError
    for number in range(800):
        reached = near.grow(rng.uniform(lower, upper))
        joined = None if reached is None else far.connect(near.poses[reached])
        if reached is not None and joined is not None:
            path = [*near.branch(reached)[::-1], *far.branch(joined)[1:]]
            path = path if number % 2 == 0 else path[::-1]
            return np.array(_shortened(path, free, rng))
        near, far = far, near
    blocked = clear_line(clearance, start, goal)
    reason = 'the arm cannot hold some pose on the straight line'
    if blocked is not None:
        reason = (
            f'on the straight line {blocked.first} and {blocked.second} come within '
            f'{blocked.distance:.4f} m'
        )
    raise TrajectoryError(f'no path to the trajectory was found: {reason}')


def clear_line(
    clearance: ClearanceModel | None, start: FloatArray, goal: FloatArray
) -> Approach | None:
    """Return an approach closer than the margin on the line between two poses, or None."""
    if clearance is None:
        return None
    difference = goal - start
    count = int(np.ceil(np.abs(difference).max() / _PROOF_INTERVAL)) + 1

    def path(share: FloatArray) -> Motion:
        q = start + share[:, np.newaxis] * difference
        dq = np.broadcast_to(difference, q.shape)
        return Motion(clearance.collision.robot.joints, share, q, dq, np.zeros_like(q))

    times = np.linspace(0.0, 1.0, count + 1)
    return clearance.first_fault(path, np.zeros(len(difference)), times)


@dataclass
class _Tree:
    """Tree of poses that are connected by collision-free straight lines."""

    poses: list[FloatArray]
    free: _Free
    parents: list[int] = field(default_factory=lambda: [-1])

    def grow(self, target: FloatArray) -> int | None:
        """Extend the tree towards a pose; return the index of the new pose, or None if blocked."""
        nearest = int(np.argmin([np.linalg.norm(target - q) for q in self.poses]))
        difference = target - self.poses[nearest]
        reach = float(np.abs(difference).max())
        if not reach > 0.0:
            return nearest
        longest = 0.6  # straight line of a tree [rad or m]
        step = target if reach <= longest else self.poses[nearest] + difference * (longest / reach)
        if not self.free(self.poses[nearest], step):
            return None
        self.poses.append(step)
        self.parents.append(nearest)
        return len(self.poses) - 1

    def connect(self, target: FloatArray) -> int | None:
        """Extend the tree up to a pose; return the index of this pose, or None if blocked."""
        while (reached := self.grow(target)) is not None:
            if np.array_equal(self.poses[reached], target):
                return reached
        return None

    def branch(self, number: int) -> list[FloatArray]:
        """Return the poses from a node back to the root of the tree."""
        poses = []
        while number >= 0:
            poses.append(self.poses[number])
            number = self.parents[number]
        return poses


def _shortened(path: list[FloatArray], free: _Free, rng: np.random.Generator) -> list[FloatArray]:
    """Shorten a path by random shortcuts along collision-free straight lines."""
    path = _skipped(path, free)
    # attempts to shorten the path
    for _ in range(60 if len(path) > 2 else 0):
        i, j = np.sort(rng.integers(0, len(path) - 1, 2))
        if i == j:
            continue
        first = path[i] + rng.random() * (path[i + 1] - path[i])
        second = path[j] + rng.random() * (path[j + 1] - path[j])
        if free(first, second):
            path = [*path[: i + 1], first, second, *path[j + 1 :]]
    return _skipped(path, free)


def _skipped(path: list[FloatArray], free: _Free) -> list[FloatArray]:
    """Shorten a path: connect each pose to the farthest pose that a free straight line reaches."""
    short, here = [path[0]], 0
    while here < len(path) - 1:
        here = next(
            there
            for there in range(len(path) - 1, here, -1)
            if there == here + 1 or free(path[here], path[there])
        )
        short.append(path[here])
    return short
