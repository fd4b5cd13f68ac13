# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Forces on the feet by the source's rule: the leg, and a share of the trunk, (20) to (22).

With two feet on the ground, the force on each foot is not determined. The source splits the trunk
between the legs by the distances of the thighs from it; a foot then bears weight and inertial
force of its leg and its share of the trunk, less the spring forces. A single foot on the ground
bears the total.

"""

from __future__ import annotations

from armid_ros.model.kinematics import points_motion
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle
from armid_ros.papers.exo.plant.walkers import columns, floating, SIDES
import numpy as np


def feet_by_shares(cycle: GaitCycle, *, other: bool = False) -> FloatArray:
    """
    Return the forces on right and left foot by (20) to (22), shape (N, 2, 2) [N].

    Parameters
    ----------
    cycle : GaitCycle
        The motion, and the feet on the ground.
    other : bool
        Whether the feet are those of the wearer.

    """
    robot, motion = (
        (cycle.pair.other, cycle.motions.other) if other else (cycle.pair.robot, cycle.motions.own)
    )
    # centroids and m (c'' - g) of all bodies, both
    bodies = list(robot.model.inertias)[1:]
    levers = np.array([body.lever for body in bodies])
    place, jacobian = points_motion(robot, list(robot.joints), levers, motion.q)
    speed = np.einsum('ncxj,nj->ncx', jacobian, motion.dq)
    hurry = np.gradient(speed, motion.t, axis=0)
    mass = np.array([body.mass for body in bodies])
    taken = mass[:, np.newaxis] * (hurry - robot.gravity)
    plane = np.array([0, 2])
    place, taken = place[..., plane], taken[..., plane]
    trunk = floating(robot)[2]
    legs = [columns(robot, side) for side in SIDES]
    # shares of the trunk, (20) to (22): the leg whose thigh is nearer carries more
    far = np.linalg.norm(place[:, [leg[0] for leg in legs]] - place[:, [trunk]], axis=-1)
    shares = far[:, ::-1] / far.sum(axis=1, keepdims=True)
    springs = cycle.torques.forces[..., plane] * (1.0 if not other else -1.0)
    feet = np.empty((len(motion), 2, 2))
    for foot, own in enumerate(legs):
        pulled = [k for k, tie in enumerate(cycle.pair.ties) if tie.name.startswith(SIDES[foot])]
        feet[:, foot] = taken[:, own].sum(axis=1) + shares[:, [foot]] * taken[:, trunk]
        feet[:, foot] -= springs[:, pulled].sum(axis=1)
    bearing = cycle.feet(other=other)[:, :, 1] > 0.0
    for foot in range(2):
        alone = bearing[:, foot] & ~bearing[:, 1 - foot]
        feet[alone, foot] = feet[alone].sum(axis=1)
        feet[alone, 1 - foot] = 0.0
    return feet


def ground_by_shares(cycle: GaitCycle) -> FloatArray:
    """
    Return the forces by (20) to (22) on heels and toes of the machine, (N, 4, 2) [N].

    The rule does not give the centre of pressure; that of the simulated ground is used.

    """
    feet = feet_by_shares(cycle)
    up = cycle.ground[..., 1].reshape(-1, 2, 2)
    whole = up.sum(axis=2, keepdims=True)
    part = np.where(whole > 0.0, up / np.where(whole > 0.0, whole, 1.0), 0.5)
    return np.asarray((part[..., np.newaxis] * feet[:, :, np.newaxis]).reshape(-1, 4, 2))
