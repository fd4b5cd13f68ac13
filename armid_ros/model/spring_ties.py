# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Springs that tie two machines together: geometry, torques and their derivatives.

A tie connects a point on a link of one machine with a point on a link of another machine, such as
a strap between a human shank and an exoskeleton shank. The vector D = p - r points from the point
r of the other machine to the point p of the first machine. A spring k pulls the first machine with
the force -k D, and the other machine with +k D. A relaxed spring has D = 0.
Source: the human-exoskeleton leg pair, equations (16), (18), (23), (25), physical signs.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from armid_ros.model.kinematics import points_motion
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
from armid_ros.robots.ties import Tie
import numpy as np

#: Step of the central differences of spring columns [rad or m].
_DIFFERENCE_STEP = 1e-5


@dataclass(frozen=True)
class TiedMachines:
    """
    Two machines, and the end points of the springs (ties) between them.

    Attributes
    ----------
    robot, other : Robot
        The machine whose torques are measured, and the machine to which it is tied.
    ties : sequence of Tie
        End points of the springs.

    """

    robot: Robot
    other: Robot
    ties: Sequence[Tie]


class TieGeometry(NamedTuple):
    """
    End points, vectors and Jacobians of springs along a motion of both machines.

    Attributes
    ----------
    way : ndarray, shape (N, S, 3)
        Vector D from the end on the other machine to the end on the first machine [m].
    position, other_position : ndarray, shape (N, S, 3)
        Positions of the two ends [m].
    jacobian : ndarray, shape (N, S, 3, n)
        Jacobian of the end on the first machine.
    other_jacobian : ndarray, shape (N, S, 3, m)
        Jacobian of the end on the other machine.

    """

    way: FloatArray
    position: FloatArray
    other_position: FloatArray
    jacobian: FloatArray
    other_jacobian: FloatArray

    def pulled(self, slack: float | FloatArray) -> FloatArray:
        """
        Return joint torques of the first machine per unit stiffness of a spring, (N, n, S) [m^2].

        A spring pulls only if it is longer than its slack [m].

        """
        way = extension(self.way, slack)
        return np.asarray(np.einsum('nsxj,nsx->njs', self.jacobian, way))


def extension(way: FloatArray, slack: float | FloatArray) -> FloatArray:
    """Return the stretch of springs (..., 3): vectors `way` minus the slack [m], or 0 if slack."""
    # the direction of a vector shorter than this [m] is undefined
    length = np.maximum(np.linalg.norm(way, axis=-1), 1e-12)
    return np.asarray(np.maximum(1.0 - slack / length, 0.0)[..., np.newaxis] * way)


def tie_geometry(
    robot: Robot, q: FloatArray, other: Robot, other_q: FloatArray, ties: Sequence[Tie]
) -> TieGeometry:
    """
    Compute end points and Jacobians of springs at positions of two machines.

    Raises
    ------
    RobotError
        If a tie names a joint that a machine does not have.

    """
    position, jacobian = points_motion(
        robot,
        [tie.joint for tie in ties],
        np.array([tie.point for tie in ties]).reshape(-1, 3),
        q,
    )
    other_position, other_jacobian = points_motion(
        other,
        [tie.other_joint for tie in ties],
        np.array([tie.other_point for tie in ties]).reshape(-1, 3),
        other_q,
    )
    return TieGeometry(
        position - other_position, position, other_position, jacobian, other_jacobian
    )


def tie_columns_derivatives(
    robot: Robot,
    q: FloatArray,
    other: Robot,
    other_q: FloatArray,
    ties: Sequence[Tie],
    slack: float | FloatArray = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """
    Return the derivatives of ``TieGeometry.pulled`` by the positions `q` and `other_q`.

    Parameters
    ----------
    robot, other : Robot
        The machines.
    q, other_q : ndarray, shape (N, n) and (N, m)
        Joint positions of the machines.
    ties : sequence of Tie
        End points of the springs.
    slack : float or ndarray, shape (S,)
        Length beyond which the springs pull [m].

    Returns
    -------
    by_q : ndarray, shape (N, n, S, n)
        Derivatives by the positions of the first machine, from central differences of 1e-5 rad.
    by_other_q : ndarray, shape (N, n, S, m)
        Derivatives by the other machine's positions; without slack exact, -J^T J of the two ends.

    """
    own, others = (_DIFFERENCE_STEP * np.eye(one.n_joints) for one in (robot, other))

    def difference(step: FloatArray | float, other_step: FloatArray | float) -> FloatArray:
        after = tie_geometry(robot, q + step, other, other_q + other_step, ties).pulled(slack)
        before = tie_geometry(robot, q - step, other, other_q - other_step, ties).pulled(slack)
        return (after - before) / (2.0 * _DIFFERENCE_STEP)

    by_q = np.stack([difference(step, 0.0) for step in own], axis=-1)
    if np.any(slack):
        return by_q, np.stack([difference(0.0, step) for step in others], axis=-1)
    here = tie_geometry(robot, q, other, other_q, ties)
    return by_q, -np.einsum('nsxi,nsxj->nisj', here.jacobian, here.other_jacobian)
