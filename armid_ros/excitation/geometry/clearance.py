# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Clearance between bodies: where they come near, how that changes, and a proof for a whole path.

Far pairs are told by their bounding capsules, near ones measured by coal.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from armid_ros.excitation.geometry.capsules import Capsules
from armid_ros.excitation.geometry.environment import body_name
from armid_ros.excitation.geometry.pose import carried_by, cross, Pose
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import CollisionModel, Robot
import numpy as np
import numpy.typing as npt
import pinocchio as pin

IntArray = npt.NDArray[np.intp]

#: Intervals are not cut below this [s] when a path is proven clear; a motion this short moves a
#: body by less than the slack the design keeps.
_SHORTEST_INTERVAL = 1e-4

#: How far a slide without limits is taken to go [m].
_LONGEST_STROKE = 10.0


@dataclass(frozen=True)
class NearPairs:
    """
    Pairs of bodies that are near each other in some of N poses, m in all.

    Attributes
    ----------
    sample, pair : ndarray of int, shape (m,)
        Which pose, which pair.
    distance : ndarray, shape (m,)
        Signed distance [m].
    by_q : ndarray, shape (m, n)
        Its derivative by the joint positions [m/rad].

    """

    sample: IntArray
    pair: IntArray
    distance: FloatArray
    by_q: FloatArray


@dataclass(frozen=True)
class Approach:
    """
    Two bodies closer than they may be.

    Attributes
    ----------
    first, second : str
        Links or obstacles.
    time : float
        When [s].
    distance : float
        How close [m]; negative in collision.

    """

    first: str
    second: str
    time: float
    distance: float

    def __str__(self) -> str:
        """Say it in a line."""
        return f'{self.first} and {self.second}: {self.distance:.4f} m apart at {self.time:.3f} s'


@dataclass(frozen=True)
class ClearanceModel:
    """
    Collision bodies, prepared for many queries.

    Attributes
    ----------
    collision : CollisionModel
        Bodies and pairs.
    capsules : Capsules
        Bounds of the bodies.
    numbers : ndarray of int, shape (number of pairs,)
        Number of each pair in the collision model.
    pairs : ndarray of int, shape (number of pairs, 2)
        Bodies of each pair.
    between : ndarray, shape (number of pairs, n)
        +1 where a joint moves the second body only, -1 the first only, 0 both or neither.
    levers : ndarray, shape (number of pairs, n)
        Most that any point of either body moves per unit of a joint's motion [m/rad, m/m].

    """

    collision: CollisionModel
    capsules: Capsules = field(repr=False)
    numbers: IntArray = field(repr=False)
    pairs: IntArray = field(repr=False)
    between: FloatArray = field(repr=False)
    levers: FloatArray = field(repr=False)

    @classmethod
    def of(cls, collision: CollisionModel) -> ClearanceModel:
        """Prepare a collision model."""
        robot = collision.robot
        capsules = Capsules.of(collision.geometry)
        joints = capsules.joints
        pairs = np.array(
            [(int(p.first), int(p.second)) for p in collision.geometry.collisionPairs],
            dtype=np.intp,
        ).reshape(-1, 2)
        moved = np.hstack(
            [carried_by(robot), np.zeros((robot.n_joints, 1))]
        ).T  # base: last row, -1
        between = moved[joints[pairs[:, 1]]] - moved[joints[pairs[:, 0]]]
        levers = np.array(
            [_levers(robot, j, r) for j, r in zip(joints, capsules.reach(), strict=True)]
        ).reshape(len(joints), robot.n_joints)
        first, second = levers[pairs[:, 0]], levers[pairs[:, 1]]
        reach = np.where(between > 0.0, second, np.where(between < 0.0, first, 0.0))
        numbers = np.arange(len(pairs))
        return cls(collision, capsules, numbers, pairs, between, reach)

    def watched(self, q: FloatArray, reach: float) -> ClearanceModel:
        """Return the model with those pairs only that come closer than ``reach`` [m] in poses."""
        kept = np.unique(self.near(q, reach).pair)
        return replace(
            self,
            numbers=self.numbers[kept],
            pairs=self.pairs[kept],
            between=self.between[kept],
            levers=self.levers[kept],
        )

    def near(self, q: FloatArray, reach: float) -> NearPairs:
        """
        Find all pairs of bodies closer than ``reach`` [m] in poses of shape (N, n).

        Pairs further apart than that may be missing from the answer or in it.

        """
        pose = Pose.of(self.collision.robot, q)
        sample, pair = np.nonzero(self.capsules.distance(pose, self.pairs) < reach)
        distance, normal, point = self._measure(q, sample, pair)
        keep = distance < reach
        sample, pair, distance = sample[keep], pair[keep], distance[keep]
        normal, point = normal[keep], point[keep, np.newaxis]
        axes = pose.axes[sample]  # (m, n, 6)
        other = point + (distance[:, np.newaxis] * normal)[:, np.newaxis]
        moved = np.where((self.between[pair] > 0.0)[..., np.newaxis], other, point)
        motion = axes[..., :3] + cross(axes[..., 3:], moved)
        along = np.einsum('mjc,mc->mj', motion, normal)
        return NearPairs(sample, pair, distance, along * self.between[pair])

    def smallest(self, q: FloatArray, reach: float = np.inf) -> FloatArray:
        """Return the smallest distance of each pose, shape (N,) [m]; at most ``reach``."""
        sample, pair = np.nonzero(self._bound(q) < reach)
        distance, _, _ = self._measure(q, sample, pair)
        result = np.full(len(q), reach)
        np.minimum.at(result, sample, distance)
        return result

    def closest(self, motion: Motion) -> Approach | None:
        """Return where the bodies of a sampled motion come closest; None without pairs."""
        if not len(self.pairs):
            return None
        reach = 0.05
        while True:
            near = self.near(motion.q, reach)
            if len(near.sample):
                worst = int(near.distance.argmin())
                time = float(motion.t[near.sample[worst]])
                return self._approach(int(near.pair[worst]), time, float(near.distance[worst]))
            reach *= 4.0

    def first_fault(
        self,
        path: Callable[[FloatArray], Motion],
        acceleration: FloatArray,
        times: FloatArray,
        margin: float,
    ) -> Approach | None:
        """
        Prove that no pair comes closer than a margin anywhere on a path, or show where.

        On an interval the distance of a pair cannot fall below the mean of its ends less half of
        what the joints in between can move its bodies; intervals for which that is not enough
        are halved.

        Parameters
        ----------
        path : callable
            From times, shape (N,), to the motion.
        acceleration : ndarray, shape (n,)
            Bound on the joint accelerations over the whole path [rad/s^2 or m/s^2].
        times : ndarray, shape (N,)
            Ends of the intervals to begin with [s].
        margin : float
            Clearance to prove [m].

        Returns
        -------
        Approach or None
            A pose that is closer, or None: there is none.

        """
        if not len(self.pairs):
            return None
        left, right = times[:-1], times[1:]
        pair = np.repeat(np.arange(len(self.pairs)), len(left))
        left, right = np.tile(left, len(self.pairs)), np.tile(right, len(self.pairs))
        while len(pair):
            moment, place = np.unique(np.concatenate([left, right]), return_inverse=True)
            motion = path(moment)
            needed, slot = np.unique(
                np.concatenate([place[: len(left)], place[len(left) :]]) * len(self.pairs)
                + np.concatenate([pair, pair]),
                return_inverse=True,
            )
            sample, number = np.divmod(needed, len(self.pairs))
            travel = self._travel(motion, place[: len(left)], right - left, acceleration, pair)
            distance = self._lower_bound(motion.q, sample, number, slot, travel, margin)
            worst = int(np.argmin(distance))
            if distance[worst] < margin:
                return self._approach(
                    int(number[worst]), float(moment[sample[worst]]), float(distance[worst])
                )
            ends = distance[slot]
            bound = 0.5 * (ends[: len(left)] + ends[len(left) :] - travel)
            open_ = (bound < margin) & (right - left > _SHORTEST_INTERVAL)
            middle = 0.5 * (left + right)[open_]
            left, right, pair = (
                np.concatenate([left[open_], middle]),
                np.concatenate([middle, right[open_]]),
                np.concatenate([pair[open_], pair[open_]]),
            )
        return None

    def _travel(
        self,
        motion: Motion,
        sample: IntArray,
        duration: FloatArray,
        acceleration: FloatArray,
        pair: IntArray,
    ) -> FloatArray:
        """Bound the relative motion of the bodies of pairs over intervals [m]."""
        speed = np.abs(motion.dq[sample]) + 0.5 * acceleration * duration[:, np.newaxis]
        return np.asarray((self.levers[pair] * speed).sum(axis=1) * duration)

    def _lower_bound(
        self,
        q: FloatArray,
        sample: IntArray,
        pair: IntArray,
        slot: IntArray,
        travel: FloatArray,
        margin: float,
    ) -> FloatArray:
        """Distances of pairs in samples; bounds where those are enough."""
        bounds = self._bound(q)[sample, pair]
        needed = np.zeros(len(sample))
        np.maximum.at(needed, slot, np.tile(travel, 2))
        near = np.flatnonzero(bounds < margin + needed)
        bounds[near] = self._measure(q, sample[near], pair[near])[0]
        return bounds

    def _bound(self, q: FloatArray) -> FloatArray:
        """Bound the distance of every pair from below, shape (N, number of pairs) [m]."""
        return self.capsules.distance(Pose.of(self.collision.robot, q), self.pairs)

    def _measure(
        self, q: FloatArray, sample: IntArray, pair: IntArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Measure pairs in samples: distances, normals to the second, points of the first."""
        model, geometry = self.collision.robot.model, self.collision.geometry
        data, placed = model.createData(), geometry.createData()
        distance = np.empty(len(sample))
        normal, point = np.empty((2, len(sample), 3))
        current = -1
        for row in np.argsort(sample, kind='stable'):
            if sample[row] != current:
                current = int(sample[row])
                pin.updateGeometryPlacements(model, data, geometry, placed, q[current])
            result = pin.computeDistance(geometry, placed, int(self.numbers[pair[row]]))
            distance[row], normal[row] = result.min_distance, result.normal
            point[row] = result.getNearestPoint1()
        return distance, normal, point

    def _approach(self, pair: int, time: float, distance: float) -> Approach:
        first, second = (body_name(self.collision, int(body)) for body in self.pairs[pair])
        return Approach(first, second, time, distance)


def _levers(robot: Robot, joint: int, length: float) -> FloatArray:
    """Most that any point of a body can move per unit of every joint, shape (n,)."""
    levers = np.zeros(robot.n_joints)
    stroke = np.where(robot.prismatic, np.maximum(np.abs(robot.lower), np.abs(robot.upper)), 0.0)
    stroke = np.minimum(stroke, _LONGEST_STROKE)
    while joint >= 0:
        levers[joint] = 1.0 if robot.prismatic[joint] else length
        length += float(np.linalg.norm(robot.geometry[joint].origin)) + float(stroke[joint])
        joint = robot.geometry[joint].parent
    return levers
