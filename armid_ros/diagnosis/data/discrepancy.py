# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Model discrepancy: the part of a misfit that is the same in every motion.

Measured torque is that of a model, and a function of the state that the model lacks, and noise
(Kennedy and O'Hagan, Bayesian calibration of computer models, 2001). The function belongs to the
arm: it was there before and is there now, so that other motions, which visit other states, have
another misfit without anything having changed. Here it is a function of position plus one of
velocity plus friction that nobody asked for, which goes with the load, in each joint, fitted to
the recordings of both days jointly with whatever is tried.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.effects import Action, Effect, merge_actions, Quantity
from armid_ros.effects.base import Arm
from armid_ros.effects.catalogue import UNASKED_FRICTION
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
#: Functions of a joint: of position, of velocity, and further friction.
_FUNCTIONS = 2 + len(UNASKED_FRICTION)


@dataclass(frozen=True)
class Discrepancy(Effect):
    """
    Torque of each joint as a function of its position, one of its velocity, and further friction.

    Both functions are linear between knots and constant beyond them. Values are torques at the
    knots, and root mean square torques of friction.

    Attributes
    ----------
    position, velocity : tuple of tuple of float
        Knots of each joint [rad or m, rad/s or m/s].
    size : tuple of float
        Root mean square torque of each joint as a rule, to which all of them contribute alike
        [N m].
    units : tuple of tuple of float
        Root mean square torque of a unit of each law of friction, of each joint.

    """

    position: tuple[tuple[float, ...], ...] = ()
    velocity: tuple[tuple[float, ...], ...] = ()
    size: tuple[float, ...] = ()
    units: tuple[tuple[float, ...], ...] = ()

    name = 'discrepancy'
    summary = 'what the model leaves of any motion, over position and velocity, and by friction'
    quantities = tuple(
        Quantity(f'discrepancy_{k}', 'N m') for k in range(_KNOTS + len(UNASKED_FRICTION))
    )
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
            Gives the load that friction goes with.

        """
        motions = [part.at_rows for part in data]
        q = np.concatenate([motion.q for motion in motions])
        top = np.max([np.abs(motion.dq).max(axis=0) for motion in motions], axis=0)
        units = [
            np.sqrt(np.mean(np.concatenate([_own(law, m, arm) for m in motions]) ** 2, axis=0))
            for law in _laws(data[0].motion.joints)
        ]
        sides = np.array([*(-share for share in reversed(_SPEEDS)), *_SPEEDS])
        return cls(
            data[0].motion.joints,
            position=_rows(np.linspace(q.min(axis=0), q.max(axis=0), _POSITIONS, axis=1)),
            velocity=_rows(np.outer(top, sides)),
            size=tuple(size.tolist()),
            units=_rows(np.where(np.array(units) > 0.0, units, 1.0)),
        )

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque of a unit at each knot, and of friction, shape (N, n, P)."""
        link = arm.link_motion(motion)
        pairs = zip(_laws(self.joints), np.array(self.units), strict=True)
        friction = [_own(law, motion, arm) / unit for law, unit in pairs]
        return joint_columns(self, motion, *self._shares(link.q, link.dq), *friction)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the torque of all functions."""
        whole = scatter(self, values, arm.robot)
        at_knots, sizes = whole[:_KNOTS], whole[_KNOTS:] / np.array(self.units)
        pairs = zip(_laws(self.joints), sizes, strict=True)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(np.einsum('k...j,kj->...j', self._shares(q, dq), at_knots))

        friction = [law.action(size, arm) for law, size in pairs]
        return merge_actions(arm.robot, [Action(link_torque=torque), *friction])

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


def _laws(joints: tuple[str, ...]) -> list[Effect]:
    """Return the friction that nobody asked for, of all joints."""
    return [kind(joints) for kind in UNASKED_FRICTION]


def _own(law: Effect, motion: Motion, arm: Arm) -> FloatArray:
    """Return the torque of a unit of a law in each joint, shape (N, n)."""
    return np.diagonal(law.columns(motion, arm), axis1=1, axis2=2)


def _hats(x: FloatArray, knots: tuple[float, ...]) -> list[FloatArray]:
    """Return the share of each knot in linear interpolation at x, each of the shape of x."""
    return [np.interp(x, knots, row) for row in np.eye(len(knots))]


def _rows(table: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in table.tolist())
