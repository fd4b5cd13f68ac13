# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Coupled joints: the map q = f(u) from the n driven joints u to the m moving joints q.

With J = df/du, the moving joints have dq = J du and ddq = J ddu + dJ/dt du. By virtual work,
torques tau of the moving joints are torques J^T tau of the driven joints. Constraint forces do no
work and do not appear. The map is affine for mimic joints and differentials. For passive joints,
Newton's method closes the loop, and the implicit function theorem gives the derivatives
(Featherstone 2008, chapter 8; Khalil and Dombre 2002, chapter 7).

"""

from __future__ import annotations

from dataclasses import dataclass
import threading
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from armid_ros.errors import RobotError
from armid_ros.motion import FloatArray, Motion
import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv


class Configuration(NamedTuple):
    """
    Positions, Jacobian and drift acceleration of the moving joints, in one or in N states.

    Attributes
    ----------
    q : ndarray, shape (m,) or (N, m)
        Positions [rad or m].
    jacobian : ndarray, shape (m, n) or (N, m, n)
        Derivative J of the positions by those of the driven joints.
    drift : ndarray, shape (m,) or (N, m)
        Accelerations dJ/dt du without an acceleration of the driven joints.

    """

    q: FloatArray
    jacobian: FloatArray
    drift: FloatArray


@dataclass(frozen=True, eq=False)
class Mechanism:
    """
    Map from positions u of the n driven joints to positions q of the m moving joints.

    The map is q = A u + B p(u) + b, where p are the positions of passive joints in loops.

    Attributes
    ----------
    joints : tuple of str
        Moving joints, in the order of the model.
    driven : ndarray, shape (m, n)
        A, the factors of the driven joints.
    passive : ndarray, shape (m, k)
        B, the factors of the passive joints p; k = 0 without loops.
    offset : ndarray, shape (m,)
        b [rad or m].
    start : tuple of ndarray, shapes (n,) and (k,)
        Positions at which the search for a closed loop begins [rad or m].
    model : pinocchio.Model
        Joints and, as frames, the points of the loops.
    loops : tuple of (int, int)
        Frames whose origins coincide.
    lower, upper : ndarray, shape (n,)
        Range in which the loops close. Beyond it the map is continued as a linear one, so that a
        search may pass through poses that it will reject.
    largest : ndarray, shape (m, n)
        Bound on the absolute values of J over the range; a sampled one with a margin for loops.

    """

    joints: tuple[str, ...]
    driven: FloatArray
    passive: FloatArray
    offset: FloatArray
    start: tuple[FloatArray, FloatArray]
    model: pin.Model
    loops: tuple[tuple[int, int], ...]
    lower: FloatArray
    upper: FloatArray
    largest: FloatArray

    @property
    def constant(self) -> bool:
        """Whether the Jacobian from driven to moving joints is constant."""
        return not self.loops

    def at(self, u: FloatArray, du: FloatArray | None = None) -> Configuration:
        """
        Return positions and Jacobian of the moving joints for one state of the driven joints.

        Parameters
        ----------
        u, du : ndarray, shape (n,)
            Positions [rad or m] and velocities, zero by default.

        Raises
        ------
        RobotError
            If a loop does not close.

        """
        if self.constant:
            return Configuration(self.driven @ u + self.offset, self.driven, 0.0 * self.offset)
        solution = self._solved(u)
        drift = np.zeros(len(solution[0])) if du is None else self._drift(*solution, du)
        return Configuration(solution[0], solution[1], drift)

    def states(self, u: FloatArray, du: FloatArray | None = None) -> Configuration:
        """Return positions and Jacobians of the moving joints for N states of driven joints."""
        m, n = self.driven.shape
        if self.constant:
            q = u @ self.driven.T + self.offset
            return Configuration(q, np.broadcast_to(self.driven, (len(u), m, n)), np.zeros_like(q))
        known, key = _SCRATCH.of(self)[2], u.tobytes()
        if key not in known:
            while len(known) > 8:  # cache of the latest motions
                known.pop(next(iter(known)))
            known[key] = [self._solved(row) for row in u]
        rows = known[key]
        drift = np.zeros((len(u), m))
        if du is not None:
            pairs = zip(rows, du, strict=True)
            drift[:] = [self._drift(q, slope, closing, x) for (q, slope, closing), x in pairs]
        q, jacobian = (np.array([row[part] for row in rows]) for part in (0, 1))
        return Configuration(q.reshape(-1, m), jacobian.reshape(-1, m, n), drift)

    def along(self, motion: Motion) -> tuple[Motion, FloatArray]:
        """Convert a motion of the driven joints to the moving joints; also return J, (N, m, n)."""
        q, jacobian, drift = self.states(motion.q, motion.dq)
        dq, ddq = (np.einsum('kmn,kn->km', jacobian, x) for x in (motion.dq, motion.ddq))
        return Motion(self.joints, motion.t, q, dq, ddq + drift), jacobian

    def _solved(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Solve the loop closure in one pose of the driven joints; return positions and Jacobian.

        The third result, (m, 3 L), is the change of the moving joints per metre between the ends.

        """
        work, inside = _SCRATCH.of(self), np.clip(u, self.lower, self.upper)
        data, (begin, p), _ = work
        far = np.abs(inside - begin).max()
        if far > 0.5:  # continuation from the start pose keeps the assembly mode
            begin, p = self.start
            far = np.abs(inside - begin).max()
        for share in np.linspace(0.0, 1.0, int(far / 0.2) + 2)[1:] if far > 0.2 else (1.0,):
            base = self.driven @ (begin + share * (inside - begin)) + self.offset
            for _ in range(20):
                gap, by_q = self._gap(data, base + self.passive @ p)
                by_p = by_q @ self.passive
                _, inverse, failed = dposv(by_p.T @ by_p, by_p.T)
                if failed:
                    raise RobotError(
                        'the positions of the driven joints do not determine the positions of the '
                        'passive joints in a closed loop'
                    )
                step = inverse @ gap
                p = p - step
                if np.abs(step).max() < 1e-12:
                    break
        if not np.abs(gap).max() < 1e-4:  # [m]; lengths of descriptions are rounded
            raise RobotError(
                f'a loop does not close: its points are {np.abs(gap).max():.3g} m apart with the '
                f'driven joints at {np.round(u, 3).tolist()}'
            )
        work[1] = inside, p
        closing = self.passive @ inverse
        jacobian = self.driven - closing @ (by_q @ self.driven)
        return base + self.passive @ p + jacobian @ (u - inside), jacobian, closing

    def _drift(
        self, q: FloatArray, jacobian: FloatArray, closing: FloatArray, du: FloatArray
    ) -> FloatArray:
        """Return the accelerations (m,) of moving joints at constant velocity of driven joints."""
        data, world = _SCRATCH.of(self)[0], pin.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(self.model, data, q, jacobian @ du, np.zeros(len(q)))
        apart = [
            pin.getFrameClassicalAcceleration(self.model, data, b, world).linear
            - pin.getFrameClassicalAcceleration(self.model, data, a, world).linear
            for a, b in self.loops
        ]
        return np.asarray(-closing @ np.concatenate(apart))

    def _gap(self, data: pin.Data, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return vectors between the two points of each loop, (3 L,) [m], and their Jacobian."""
        pin.computeJointJacobians(self.model, data, q)
        pin.updateFramePlacements(self.model, data)
        world, gaps, slopes = pin.LOCAL_WORLD_ALIGNED, [], []
        for a, b in self.loops:
            first, second = (pin.getFrameJacobian(self.model, data, k, world)[:3] for k in (a, b))
            gaps.append(data.oMf[b].translation - data.oMf[a].translation)
            slopes.append(second - first)
        return np.concatenate(gaps), np.concatenate(slopes)


class _Scratch(threading.local):
    """Cache per thread and mechanism: Pinocchio data, last solution and solved motions."""

    def __init__(self) -> None:
        self._of: WeakKeyDictionary[Mechanism, list[Any]] = WeakKeyDictionary()

    def of(self, mechanism: Mechanism) -> list[Any]:
        if mechanism not in self._of:
            self._of[mechanism] = [mechanism.model.createData(), mechanism.start, {}]
        return self._of[mechanism]


_SCRATCH = _Scratch()
