# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Regression columns of the model discrepancy: torque over position and velocity that a model lacks.

Measured torque is the sum of the torque of the model, the model discrepancy, and noise (Kennedy
and O'Hagan, Bayesian calibration of computer models, 2001). The discrepancy is a fixed function of
the arm. A new motion visits other states, so its residual differs although nothing has changed. In
each joint, the discrepancy is a function of position, plus one of velocity, plus load-dependent
friction. It is fitted to baseline and diagnosed recordings, together with each candidate cause.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.diagnosis.data.trajectory import Trajectory
from armid_ros.effects.base import Arm
from armid_ros.effects.catalogue import UNASKED_FRICTION
from armid_ros.motion import FloatArray
import numpy as np

#: Number of knots of the function of position, evenly over the range of motion.
_POSITION_KNOTS = 4
#: Knots of the function of velocity on each side, as shares of the top speed: friction changes
#: most at low speed.
_SPEED_KNOTS = (0.03, 0.25, 1.0)


def discrepancy_columns(data: Sequence[Trajectory], arm: Arm) -> list[FloatArray]:
    """
    Return regressor columns for smooth model errors of each joint (model discrepancy).

    Functions of position and velocity are linear between knots and constant beyond them, with a
    unit torque at a knot; friction has a root mean square torque of one.

    Parameters
    ----------
    data : sequence of Trajectory
        All recordings, whose motions give the knots.
    arm : Arm
        Model that computes the load of the load-dependent friction.

    Returns
    -------
    list of ndarray, each (M, n, n f)
        Columns of each trajectory: f basis functions of the first joint, then of the next ones.

    """
    motions = [part.at_rows for part in data]
    q = np.concatenate([motion.q for motion in motions])
    top = np.max([np.abs(motion.dq).max(axis=0) for motion in motions], axis=0)
    positions = np.linspace(q.min(axis=0), q.max(axis=0), _POSITION_KNOTS)
    velocities = np.outer([*(-share for share in reversed(_SPEED_KNOTS)), *_SPEED_KNOTS], top)
    friction = []
    for motion in motions:  # the friction laws that are not fitted by default
        laws = [kind(motion.joints).columns(motion, arm) for kind in UNASKED_FRICTION]
        friction.append(np.stack([np.diagonal(x, axis1=1, axis2=2) for x in laws], axis=2))
    size = np.sqrt(np.mean(np.concatenate(friction) ** 2, axis=0))
    unit = np.where(size > 0.0, size, 1.0)
    found = []
    for motion, torque in zip(motions, friction, strict=True):
        link, own = arm.link_motion(motion), torque / unit
        count = len(positions) + len(velocities) + own.shape[2]
        columns = np.zeros((*motion.q.shape, motion.n_joints * count))
        for joint in range(motion.n_joints):
            columns[:, joint, joint * count : (joint + 1) * count] = np.column_stack(
                [
                    *hat_functions(link.q[:, joint], positions[:, joint]),
                    *hat_functions(link.dq[:, joint], velocities[:, joint]),
                    own[:, joint],
                ]
            )
        found.append(columns)
    return found


def hat_functions(x: FloatArray, knots: FloatArray) -> list[FloatArray]:
    """Return linear B-splines (hat functions) at x: for each knot an array like x."""
    return [np.interp(x, knots, row) for row in np.eye(len(knots))]
