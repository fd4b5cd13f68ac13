# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Model discrepancy: the part of a misfit that is the same in every motion.

Measured torque is that of a model, and a function of the state that the model lacks, and noise
(Kennedy and O'Hagan, Bayesian calibration of computer models, 2001). The function belongs to the
arm: it was there before and is there now, so that other motions, which visit other states, have
another misfit without anything having changed. Here it is a function of position plus one of
velocity plus friction in proportion to the load in each joint, fitted to the recordings of both
days jointly with whatever is tried.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.effects import Action, Effect, Quantity
from armid_ros.effects.base import Arm
from armid_ros.effects.hysteresis import LoadDependentFriction
from armid_ros.effects.layout import joint_columns, scatter
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

#: Knots of the function of position, evenly over the range of motion.
_POSITIONS = 4
#: Knots of the function of velocity on each side, over the top speed: friction changes most where
#: a joint is slow.
_SPEEDS = (0.03, 0.25, 1.0)
_KNOTS = _POSITIONS + 2 * len(_SPEEDS)
#: Functions of a joint: of position, of velocity, and friction by load.
_FUNCTIONS = 3


@dataclass(frozen=True)
class Discrepancy(Effect):
    """
    Torque of each joint as a function of its position, one of its velocity, and friction by load.

    Both functions are linear between knots and constant beyond them. Values are torques at the
    knots, and friction at the usual load.

    Attributes
    ----------
    position, velocity : tuple of tuple of float
        Knots of each joint [rad or m, rad/s or m/s].
    size : tuple of float
        Root mean square torque of each joint as a rule, to which all three contribute alike [N m].
    load : tuple of float
        Root mean square load of each joint: what the rigid body takes [N m].

    """

    position: tuple[tuple[float, ...], ...] = ()
    velocity: tuple[tuple[float, ...], ...] = ()
    size: tuple[float, ...] = ()
    load: tuple[float, ...] = ()

    name = 'discrepancy'
    summary = 'what the model leaves of any motion, over position, velocity and load'
    quantities = tuple(Quantity(f'discrepancy_{k}', 'N m') for k in range(_KNOTS + 1))
    learned = True
    smooth = True

    @classmethod
    def over(cls, data: Sequence[Trajectory], size: FloatArray, arm: Arm) -> Discrepancy:
        """
        Return a discrepancy of all joints whose knots are where data are.

        Parameters
        ----------
        data : sequence of Trajectory
            The recordings of both days.
        size : ndarray, shape (n,)
            Root mean square torque as a rule [N m].
        arm : Arm
            Gives the load.

        """
        q = np.concatenate([part.at_rows.q for part in data])
        top = np.max([np.abs(part.at_rows.dq).max(axis=0) for part in data], axis=0)
        load = np.concatenate([arm.load(part.at_rows) for part in data])
        usual = np.sqrt(np.mean(load**2, axis=0))
        sides = np.array([*(-share for share in reversed(_SPEEDS)), *_SPEEDS])
        return cls(
            data[0].motion.joints,
            position=_rows(np.linspace(q.min(axis=0), q.max(axis=0), _POSITIONS, axis=1)),
            velocity=_rows(np.outer(top, sides)),
            size=tuple(size.tolist()),
            load=tuple(np.where(usual > 0.0, usual, 1.0).tolist()),
        )

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque of a unit at each knot and at the usual load, shape (N, n, P)."""
        link = arm.link_motion(motion)
        friction = LoadDependentFriction(self.joints).columns(motion, arm)
        by_load = np.diagonal(friction, axis1=1, axis2=2) / np.array(self.load)
        return joint_columns(self, motion, *self._shares(link.q, link.dq), by_load)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the torque of all functions."""
        whole = scatter(self, values, arm.robot)
        at_knots, by_load = whole[:-1], whole[-1] / np.array(self.load)
        friction = LoadDependentFriction(self.joints).action(by_load, arm)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(np.einsum('k...j,kj->...j', self._shares(q, dq), at_knots))

        return replace(friction, link_torque=torque)

    def spread(self, robot: Robot, found: Sequence[FloatArray] | None = None) -> FloatArray:
        """Return the standard deviations of the prior, shape (P,)."""
        return np.repeat(np.array(self.size) / np.sqrt(_FUNCTIONS), len(self.quantities))

    def _shares(self, q: FloatArray, dq: FloatArray) -> FloatArray:
        """Return the share of each knot at states (..., n), shape (K, ..., n)."""
        rows = zip(self.position, self.velocity, strict=True)
        joints = [
            [*_hats(q[..., joint], position), *_hats(dq[..., joint], velocity)]
            for joint, (position, velocity) in enumerate(rows)
        ]
        return np.moveaxis(np.array(joints), 0, -1)


def _hats(x: FloatArray, knots: tuple[float, ...]) -> list[FloatArray]:
    """Return the share of each knot in linear interpolation at x, each of the shape of x."""
    return [np.interp(x, knots, row) for row in np.eye(len(knots))]


def _rows(table: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in table.tolist())
