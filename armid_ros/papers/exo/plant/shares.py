# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What each foot bears by the source's rule: a leg, and the trunk's share by (20) to (22).

Two feet on the ground leave open how much each bears. The source splits the trunk between the legs
by the distances of the thighs from it; a foot then bears what its leg and its share of the trunk
weigh and take to accelerate, less what the springs carry. While one foot stands it bears all.

"""

from __future__ import annotations

from armid_ros.model.kinematics import points_motion
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait_cycle import GaitCycle
from armid_ros.papers.exo.plant.walkers import columns, floating, SIDES
import numpy as np

_PLANE = np.array([0, 2])


def feet_by_shares(cycle: GaitCycle, *, other: bool = False) -> FloatArray:
    """
    Return what both feet bear by (20) to (22), right and left, shape (N, 2, 2) [N].

    Parameters
    ----------
    cycle : GaitCycle
        The motion, and which feet stand.
    other : bool
        Whether of the wearer.

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
    place, taken = place[..., _PLANE], taken[..., _PLANE]
    trunk = floating(robot)[2]
    legs = [columns(robot, side) for side in SIDES]
    # shares of the trunk, (20) to (22): the leg whose thigh is nearer carries more
    far = np.linalg.norm(place[:, [leg[0] for leg in legs]] - place[:, [trunk]], axis=-1)
    shares = far[:, ::-1] / far.sum(axis=1, keepdims=True)
    springs = cycle.torques.forces[..., _PLANE] * (1.0 if not other else -1.0)
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
    Return the same on heels and toes of the machine, (N, 4, 2) [N].

    The rule does not say where under a foot its force is; it is taken to be where the ground's is.

    """
    feet = feet_by_shares(cycle)
    up = cycle.ground[..., 1].reshape(-1, 2, 2)
    whole = up.sum(axis=2, keepdims=True)
    part = np.where(whole > 0.0, up / np.where(whole > 0.0, whole, 1.0), 0.5)
    return np.asarray((part[..., np.newaxis] * feet[:, :, np.newaxis]).reshape(-1, 4, 2))
