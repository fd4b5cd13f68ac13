# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Clearance between bodies: distances, their derivatives, and a proof for whole paths.

Bounding spheres exclude distant pairs; coal computes the distances of the other pairs.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from armid_ros.excitation.geometry.environment import body_name
from armid_ros.model import LinkFrames
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import CollisionModel
import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

IntArray = npt.NDArray[np.intp]


@dataclass(frozen=True)
class NearPairs:
    """
    All m cases in which a pair of bodies is close to each other in one of N poses.

    Attributes
    ----------
    sample, pair : ndarray of int, shape (m,)
        Index of the pose, and index of the pair of bodies.
    distance : ndarray, shape (m,)
        Signed distance [m].
    by_q : ndarray, shape (m, n)
        Derivative of the distance by the joint positions [m/rad].

    """

    sample: IntArray
    pair: IntArray
    distance: FloatArray
    by_q: FloatArray


@dataclass(frozen=True)
class Approach:
    """
    Approach of two bodies: their names, their distance, and the time.

    Attributes
    ----------
    first, second : str
        Names of the links or obstacles.
    time : float
        Time of the approach [s].
    distance : float
        Distance [m]; negative in collision.

    """

    first: str
    second: str
    time: float
    distance: float

    def __str__(self) -> str:
        """Return the two bodies, their distance and the time in one line."""
        return f'{self.first} and {self.second}: {self.distance:.4f} m apart at {self.time:.3f} s'


@dataclass(frozen=True)
class ClearanceModel:
    """
    Collision bodies of an arm, prepared to compute their distances in many poses.

    Attributes
    ----------
    collision : CollisionModel
        Bodies and pairs.
    margin : float
        Clearance to keep [m].
    joints : ndarray of int, shape (number of bodies,)
        Joint that carries each body, -1 for those that do not move.
    spheres : ndarray, shape (number of bodies, 4)
        Centre in the frame of that joint and radius of a sphere around each body [m].
    planes : ndarray, shape (number of bodies, 4)
        Normal and offset [m] of half spaces, the points x with normal x <= offset; else NaN.
    numbers : ndarray of int, shape (number of pairs,)
        Number of each pair in the collision model.
    pairs : ndarray of int, shape (number of pairs, 2)
        Bodies of each pair.
    between : ndarray, shape (number of pairs, m)
        +1 if a moving joint moves the second body only, -1 the first body only, 0 both or neither.
    levers : ndarray, shape (number of pairs, n)
        Largest motion of any point of either body per unit of a joint's motion [m/rad, m/m].

    """

    collision: CollisionModel
    margin: float
    joints: IntArray = field(repr=False)
    spheres: FloatArray = field(repr=False)
    planes: FloatArray = field(repr=False)
    numbers: IntArray = field(repr=False)
    pairs: IntArray = field(repr=False)
    between: FloatArray = field(repr=False)
    levers: FloatArray = field(repr=False)

    @classmethod
    def of(cls, collision: CollisionModel, margin: float = 0.0) -> ClearanceModel:
        """Return the clearance model of bodies that have to stay a margin [m] apart."""
        robot, bodies = collision.robot, list(collision.geometry.geometryObjects)
        joints = np.array([int(body.parentJoint) - 1 for body in bodies], dtype=np.intp)
        spheres, planes = np.zeros((len(bodies), 4)), np.full((len(bodies), 4), np.nan)
        for number, body in enumerate(bodies):
            shape, place = body.geometry, body.placement
            if isinstance(shape, coal.Halfspace):
                normal = place.rotation @ shape.n
                planes[number] = (*normal, shape.d + normal @ place.translation)
            else:
                shape.computeLocalAABB()
                spheres[number] = (*place.act(shape.aabb_center), shape.aabb_radius)
        pairs = np.array(
            [(int(p.first), int(p.second)) for p in collision.geometry.collisionPairs],
            dtype=np.intp,
        ).reshape(-1, 2)
        tree = robot.tree
        moved = np.zeros((tree.n_joints + 1, tree.n_joints))  # base: last row, -1
        for number, joint in enumerate(robot.geometry):
            moved[number, list(joint.movers)] = 1.0
        between = moved[joints[pairs[:, 1]]] - moved[joints[pairs[:, 0]]]
        reach = np.linalg.norm(spheres[:, :3], axis=1) + spheres[:, 3]
        stroke = np.maximum(np.abs(tree.lower), np.abs(tree.upper))
        stroke = np.where(tree.prismatic, np.minimum(stroke, 10.0), 0.0)  # 10 m without limits
        levers = np.zeros((len(joints), tree.n_joints))
        for row, joint, length in zip(levers, joints, reach, strict=True):
            while joint >= 0:
                row[joint] = 1.0 if tree.prismatic[joint] else length
                length += np.linalg.norm(robot.geometry[joint].origin) + stroke[joint]
                joint = robot.geometry[joint].parent
        first, second = levers[pairs[:, 0]], levers[pairs[:, 1]]
        most = np.where(between > 0.0, second, np.where(between < 0.0, first, 0.0))
        if robot.mechanism is not None:
            most = most @ robot.mechanism.largest
        numbers = np.arange(len(pairs))
        return cls(collision, margin, joints, spheres, planes, numbers, pairs, between, most)

    def without_distant_pairs(self, q: FloatArray, reach: float) -> ClearanceModel:
        """Return the model without pairs of bodies at least ``reach`` [m] apart in all poses q."""
        kept = np.unique(self.near(q, reach).pair)
        return replace(
            self,
            numbers=self.numbers[kept],
            pairs=self.pairs[kept],
            between=self.between[kept],
            levers=self.levers[kept],
        )

    def near(self, q: FloatArray, reach: float) -> NearPairs:
        """Return all pairs of bodies closer than ``reach`` [m] in poses of shape (N, n)."""
        frames = LinkFrames.of(self.collision.robot, q)
        sample, pair = np.nonzero(self._bound(frames) < reach)
        distance, normal, point = self._measure(q, sample, pair, reach)
        keep = distance < reach
        sample, pair, distance = sample[keep], pair[keep], distance[keep]
        normal, point = normal[keep], point[keep, np.newaxis]
        other = point + (distance[:, np.newaxis] * normal)[:, np.newaxis]
        moved = np.where((self.between[pair] > 0.0)[..., np.newaxis], other, point)
        lines, turns = (
            axes[..., sample].transpose(2, 0, 1) for axes in (frames.lines, frames.turns)
        )
        motion = lines + np.cross(turns, moved)
        speed = np.einsum('mjc,mc->mj', motion, normal)
        by_q = speed * self.between[pair]
        if frames.coupling is not None:
            by_q = np.einsum('km,kmn->kn', by_q, frames.coupling[sample])
        return NearPairs(sample, pair, distance, by_q)

    def smallest(self, q: FloatArray, reach: float = np.inf) -> FloatArray:
        """Return the smallest distance of two bodies in each pose, (N,) [m]; at most ``reach``."""
        sample, pair = np.nonzero(self._bound(LinkFrames.of(self.collision.robot, q)) < reach)
        distance, _, _ = self._measure(q, sample, pair)
        result = np.full(len(q), reach)
        np.minimum.at(result, sample, distance)
        return result

    def closest(self, motion: Motion) -> Approach | None:
        """Return the closest approach of two bodies in a motion; None if no pair is checked."""
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
    ) -> Approach | None:
        """
        Return an approach closer than the margin on a path; None proves that there is none.

        On an interval, the joints between two bodies move them by a limited travel. Their distance
        is at least the mean of the distances at both ends, minus half this travel. An interval
        for which this bound is below the margin is halved.

        Parameters
        ----------
        path : callable
            Function from times, shape (N,), to the motion.
        acceleration : ndarray, shape (n,)
            Bound on the joint accelerations over the whole path [rad/s^2 or m/s^2].
        times : ndarray, shape (N,)
            Ends of the initial intervals [s].

        Returns
        -------
        Approach or None
            A pose with a smaller distance; None: there is no such pose.

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
                place * len(self.pairs) + np.concatenate([pair, pair]), return_inverse=True
            )
            sample, number = np.divmod(needed, len(self.pairs))
            duration = right - left
            speed = np.abs(motion.dq[place[: len(left)]])
            speed += 0.5 * acceleration * duration[:, np.newaxis]
            travel = (self.levers[pair] * speed).sum(axis=1) * duration
            within = np.full(len(needed), self.margin)
            np.maximum.at(within, slot, self.margin + np.tile(travel, 2))
            distance = self._bound(LinkFrames.of(self.collision.robot, motion.q))[sample, number]
            near = np.flatnonzero(distance < within)
            distance[near] = self._measure(motion.q, sample[near], number[near])[0]
            worst = int(np.argmin(distance))
            if distance[worst] < self.margin:
                return self._approach(
                    int(number[worst]), float(moment[sample[worst]]), float(distance[worst])
                )
            ends = distance[slot]
            bound = 0.5 * (ends[: len(left)] + ends[len(left) :] - travel)
            # shortest interval of the proof [s]; in it, a body moves by less than the additional
            # clearance of a design
            open_ = (bound < self.margin) & (duration > 1e-4)
            middle = 0.5 * (left + right)[open_]
            left, right, pair = (
                np.concatenate([left[open_], middle]),
                np.concatenate([middle, right[open_]]),
                np.concatenate([pair[open_], pair[open_]]),
            )
        return None

    def _bound(self, frames: LinkFrames) -> FloatArray:
        """Return lower bounds on the distances of pairs of bodies, (N, number of pairs) [m]."""
        centre = np.empty((len(self.joints), 3, frames.lines.shape[2]))
        for body, joint in enumerate(self.joints):
            place = self.spheres[body, :3]
            centre[body].T[:] = place if joint < 0 else frames.places(frames.joints[joint], place)
        first, second = self.pairs.T
        between = centre[second] - centre[first]
        apart = np.sqrt(np.einsum('kcs,kcs->ks', between, between))
        for pair in np.flatnonzero(np.isfinite(self.planes[second, 3])):
            plane = self.planes[second[pair]]
            apart[pair] = plane[:3] @ centre[first[pair]] - plane[3]
        return np.asarray(apart.T - self.spheres[first, 3] - self.spheres[second, 3])

    def _measure(
        self, q: FloatArray, sample: IntArray, pair: IntArray, reach: float = -np.inf
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return distances of pairs; if below `reach`, also normals and nearest points, (m, 3)."""
        model, geometry = self.collision.robot.model, self.collision.geometry
        data, placed = model.createData(), geometry.createData()
        q, distance = self.collision.robot.positions(q), np.empty(len(sample))
        normal, point = np.empty((2, len(sample), 3))
        current, order = -1, np.argsort(sample, kind='stable')
        rows = order.tolist(), sample[order].tolist(), self.numbers[pair[order]].tolist()
        for row, pose, number in zip(*rows, strict=True):
            if pose != current:
                current = pose
                pin.updateGeometryPlacements(model, data, geometry, placed, q[current])
            result = pin.computeDistance(geometry, placed, number)
            distance[row] = result.min_distance
            if distance[row] < reach:
                normal[row], point[row] = result.normal, result.getNearestPoint1()
        return distance, normal, point

    def _approach(self, pair: int, time: float, distance: float) -> Approach:
        first, second = (body_name(self.collision, int(body)) for body in self.pairs[pair])
        return Approach(first, second, time, distance)
