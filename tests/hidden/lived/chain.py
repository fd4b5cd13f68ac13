# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Inverse dynamics of a tree of revolute joints, vectorised over samples.

The recursive Newton-Euler algorithm (Luh, Walker, Paul 1980) in body frames, on the bodies that
MuJoCo compiles from a description. Bodies are given by mass, first moments and inertia about the
frame's origin, in which the torque is linear.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.robots import Robot
import mujoco
import numpy as np

from tests.hidden.arrays import body_vector, FloatArray, symmetric
from tests.hidden.descriptions import bare_urdf

PARAMETERS_PER_BODY = 10

#: Samples at a time: few enough for the processor's cache.
_CHUNK = 4096


@dataclass(frozen=True)
class Chain:
    """
    Rigid bodies behind joints.

    Attributes
    ----------
    joints : tuple of str
        Names, a parent before its children.
    parent : tuple of int
        Index of the body that carries each body; -1 for the base.
    place : ndarray, shape (n, 3)
        Origin of each body frame in the frame of its parent at position zero [m].
    turn : ndarray, shape (n, 3, 3)
        Rotation from each body frame to the frame of its parent at position zero.
    axis : ndarray, shape (n, 3)
        Axis of each joint in the body frame, of length 1; all joints turn.
    bodies : ndarray, shape (n, 10)
        m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the origin of the body frame.
    gravity : ndarray, shape (3,)
        Acceleration of gravity in the base frame [m/s^2].

    """

    joints: tuple[str, ...]
    parent: tuple[int, ...]
    place: FloatArray
    turn: FloatArray
    axis: FloatArray
    bodies: FloatArray
    gravity: FloatArray

    @classmethod
    def of(cls, robot: Robot) -> Chain:
        """Take the bodies of a robot from what MuJoCo makes of its description."""
        if any(robot.prismatic):
            raise ValueError(f'{robot.name}: a joint slides; here all joints turn')
        spec = mujoco.MjSpec.from_string(bare_urdf(robot))
        spec.compiler.fusestatic, spec.compiler.balanceinertia = True, False
        model = spec.compile()
        ids = [int(model.joint(joint).bodyid[0]) for joint in robot.joints]
        count = len(ids)
        bodies = np.zeros((count, PARAMETERS_PER_BODY))
        for j, body in enumerate(ids):
            frame = _matrix(model.body_iquat[body])
            central = frame @ np.diag(model.body_inertia[body]) @ frame.T
            bodies[j] = body_vector(model.body_mass[body], model.body_ipos[body], central)
        return cls(
            joints=robot.joints,
            parent=tuple(ids.index(body) if body else -1 for body in model.body_parentid[ids]),
            place=model.body_pos[ids].copy(),
            turn=np.array([_matrix(model.body_quat[body]) for body in ids]),
            axis=np.array([model.joint(joint).axis for joint in robot.joints]),
            bodies=bodies,
            gravity=np.array(robot.gravity),
        )

    @property
    def n_joints(self) -> int:
        """Return the number of joints n."""
        return len(self.joints)

    def with_gravity(self, gravity: FloatArray) -> Chain:
        """Return the arm in another gravity, shape (3,) [m/s^2]."""
        return replace(self, gravity=np.asarray(gravity, dtype=float))

    def with_body(self, joint: int, difference: FloatArray) -> Chain:
        """Return the arm with something fixed to a link, shape (10,)."""
        bodies = self.bodies.copy()
        bodies[joint] += difference
        return replace(self, bodies=bodies)

    def torque(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the torque of the joints along a motion, all of shape (N, n)."""
        parts = []
        for start in range(0, len(q), _CHUNK):
            rows = slice(start, start + _CHUNK)
            parts.append(self._torque(q[rows].T, dq[rows].T, ddq[rows].T).T)
        return np.concatenate(parts)

    def point(
        self, joint: int, offset: FloatArray, q: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """
        Return where a point of a link is and how it moves with the joints.

        Returns
        -------
        position : ndarray, shape (3, N)
            In the base frame [m].
        jacobian : ndarray, shape (n, 3, N)
            Derivative of the position by each joint; zero for those that do not carry it.

        """
        q = q.T
        n, samples = q.shape
        jacobian = np.zeros((n, 3, samples))
        path = [joint]
        while self.parent[path[-1]] >= 0:
            path.append(self.parent[path[-1]])
        position = np.repeat(np.asarray(offset, dtype=float)[:, np.newaxis], samples, axis=1)
        arms = {}  # from the origin of each body on the path, in its frame
        for j in path:
            arms[j] = position
            position = self.turn[j] @ self._joint_turn(j, q[j], position) + self.place[j][:, None]
        for j in path:
            way = _cross(self.axis[j][:, np.newaxis], arms[j])
            k = j
            while k >= 0:
                way = self.turn[k] @ self._joint_turn(k, q[k], way)
                k = self.parent[k]
            jacobian[j] = way
        return position, jacobian

    def columns(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the torque per body parameter along a motion, shape (N, n, 10 n)."""
        frames = self._frames(q.T, dq.T, ddq.T)
        columns = np.zeros((len(q), self.n_joints, PARAMETERS_PER_BODY * self.n_joints))
        for j in range(self.n_joints):
            for p, unit in enumerate(np.eye(PARAMETERS_PER_BODY)):
                force, moment = _wrench(unit, *frames[j])
                k = j
                while k >= 0:
                    columns[:, k, PARAMETERS_PER_BODY * j + p] = self.axis[k] @ moment
                    force, moment = self._to_parent(k, q[:, k], force, moment)
                    k = self.parent[k]
        return columns

    def _torque(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        frames = self._frames(q, dq, ddq)
        wrenches = [_wrench(body, *frame) for body, frame in zip(self.bodies, frames, strict=True)]
        tau = np.empty_like(q)
        for j in reversed(range(self.n_joints)):
            force, moment = wrenches[j]
            tau[j] = self.axis[j] @ moment
            above = self.parent[j]
            if above >= 0:
                more = self._to_parent(j, q[j], force, moment)
                wrenches[above] = wrenches[above][0] + more[0], wrenches[above][1] + more[1]
        return tau

    def _frames(
        self, q: FloatArray, dq: FloatArray, ddq: FloatArray
    ) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        """Return w, dw and the acceleration of the origin less gravity of each body, (3, N)."""
        samples = q.shape[1]
        zero = np.zeros((3, samples))
        base = (zero, zero, np.repeat(-self.gravity[:, np.newaxis], samples, axis=1))
        frames: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        for j in range(self.n_joints):
            above = self.parent[j]
            w, dw, a = frames[above] if above >= 0 else base
            axis = self.axis[j][:, np.newaxis]
            arm = self.place[j][:, np.newaxis]
            a = a + _cross(dw, arm) + _cross(w, _cross(w, arm))
            w, dw, a = (self._joint_turn(j, -q[j], self.turn[j].T @ x) for x in (w, dw, a))
            dw = dw + axis * ddq[j] + _cross(w, axis * dq[j])
            w = w + axis * dq[j]
            frames.append((w, dw, a))
        return frames

    def _joint_turn(self, j: int, angle: FloatArray, x: FloatArray) -> FloatArray:
        """Turn vectors (3, N) by the angle of a joint about its axis (Rodrigues)."""
        axis = self.axis[j][:, np.newaxis]
        cosine = np.cos(angle)
        along = (1.0 - cosine) * (self.axis[j] @ x)
        return x * cosine + _cross(axis, x) * np.sin(angle) + axis * along

    def _to_parent(
        self, j: int, value: FloatArray, force: FloatArray, moment: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return force and moment of a body about the origin of its parent, in that frame."""
        force = self.turn[j] @ self._joint_turn(j, value, force)
        moment = self.turn[j] @ self._joint_turn(j, value, moment)
        return force, moment + _cross(self.place[j][:, np.newaxis], force)


def _wrench(
    body: FloatArray, w: FloatArray, dw: FloatArray, a: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the force and the moment about the origin that move a body, each (3, N)."""
    mass, moment = body[0], body[1:4][:, np.newaxis]
    inertia = symmetric(body[4:])
    force = mass * a + _cross(dw, moment) + _cross(w, _cross(w, moment))
    return force, inertia @ dw + _cross(w, inertia @ w) + _cross(moment, a)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def _matrix(quaternion: FloatArray) -> FloatArray:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
