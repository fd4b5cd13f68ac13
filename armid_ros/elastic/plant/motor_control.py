# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the drives of an arm with elastic joints do: velocity loops, alone or led by a model."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.elastic.plant.plant import ElasticPlant
from armid_ros.elastic.plant.run import VelocityLoop
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.controller import BANDWIDTH
from armid_ros.simulation.plant import middle_position
import numpy as np
import pinocchio as pin

#: Share of a motor's velocity that one sampled action of its loop may take away.
_QUICKEST = 0.3


@dataclass(frozen=True, eq=False)
class MotorControl:
    """
    A velocity loop on every motor.

    Attributes
    ----------
    loop : VelocityLoop
        The loops; the integral of the velocity's error is that of the position.
    guide : ElasticPlant, or None
        What they believe of the arm: its torque along the reference is added to theirs, and the
        motors are led ahead of the links by the twist of their springs. None: loops alone.

    """

    loop: VelocityLoop
    guide: ElasticPlant | None = None

    @classmethod
    def of(cls, plant: ElasticPlant) -> MotorControl:
        """
        Return a control that suits an arm, and knows it.

        The gain on the velocity is the least of what a rigid joint needs for 8 Hz, of what damps
        the link on its spring best, sqrt(K M), and of what a sampled loop may do to a rotor. That
        on the position damps the joint critically.

        """
        robot, e = plant.robot, len(plant.elastic)
        link = np.diag(pin.crba(robot.model, robot.model.createData(), middle_position(robot)))
        rotor = np.zeros(robot.n_joints)
        rotor[:] = np.diag(plant.rotors)[e:]
        rotor[plant.elastic] = np.diag(plant.rotors)[:e]
        inertia = link + rotor
        gain = 2.0 * BANDWIDTH * inertia
        joints = plant.elastic
        gain[joints] = np.minimum.reduce(
            [
                gain[joints],
                np.sqrt(plant.springs.stiffness * link[joints]),
                _QUICKEST * rotor[joints] / plant.dt,
            ]
        )
        return cls(VelocityLoop(gain, gain**2 / (4.0 * inertia)), plant)

    def targets(self, desired: Motion) -> tuple[FloatArray, FloatArray]:
        """
        Return where the loops are to bring the motors, and the torque that is added to theirs.

        Parameters
        ----------
        desired : Motion
            Of the links; its torque, if it has one, is added too.

        Returns
        -------
        q, tau : ndarray, shape (N, n)
            [rad or m], [N m].

        """
        tau = np.zeros_like(desired.q) if desired.tau is None else np.array(desired.tau)
        if self.guide is None:
            return desired.q, tau
        plant, q = self.guide, desired.q.copy()
        load = inverse_dynamics(plant.robot, desired)
        push = load[:, plant.elastic]
        q[:, plant.elastic] += push / plant.springs.stiffness + np.sign(push) * plant.springs.gap
        return q, tau + load + plant.rigid.action.effort(desired, desired, load)
