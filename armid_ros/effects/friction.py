# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction of the joints: viscous, Coulomb, asymmetric, and between two coupled joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from armid_ros.effects.base import Action, DryFriction, Effect, joint_columns, Quantity, scatter
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

if TYPE_CHECKING:
    from armid_ros.arm import ArmModel


@dataclass(frozen=True)
class ViscousFriction(Effect):
    """
    Friction torque proportional to joint velocity, tau = Fv dq.

    Confounded with back-EMF (motor-side data) and, at a single frequency, with a torque delay.
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994.

    """

    name = 'viscous_friction'
    summary = 'torque proportional to joint velocity'
    quantities = (Quantity('viscous_coefficient', 'N m s/rad', lower=0.0),)

    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """Return dtau/dFv = dq [rad/s], shape (N, n, P)."""
        return joint_columns(self, motion, motion.dq)

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return the damping matrix."""
        (viscous,) = scatter(self, values, arm.robot)
        return Action(damping=np.diag(viscous))


@dataclass(frozen=True)
class CoulombFriction(Effect):
    """
    Friction torque that depends on the direction of motion only, tau = Fc sign(dq).

    At rest it holds with any torque up to Fc. Confounded with a torque offset when a joint moves
    in one direction only.
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994.

    """

    name = 'coulomb_friction'
    summary = 'constant torque against the direction of motion; holds at rest'
    quantities = (Quantity('coulomb_torque', 'N m', lower=0.0),)
    holds_at_rest = True

    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """Return dtau/dFc = sign(dq) [-], shape (N, n, P)."""
        return joint_columns(self, motion, np.sign(motion.dq))

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return dry friction between -Fc and Fc."""
        (coulomb,) = scatter(self, values, arm.robot)
        return Action(dry_friction=DryFriction(np.eye(len(coulomb)), -coulomb, coulomb))


@dataclass(frozen=True)
class AsymmetricFriction(Effect):
    """
    What friction differs by between the two directions of motion.

    tau = dFc |sign(dq)| + dFv |dq|, where dFc = (Fc+ - Fc-) / 2 and dFv = (Fv+ - Fv-) / 2 of a
    joint with Fc+, Fv+ forwards and Fc-, Fv- backwards; the means belong to coulomb_friction and
    viscous_friction. While the joint moves, dFc is the same as a torque offset, exactly.

    """

    name = 'asymmetric_friction'
    summary = 'friction that differs between the two directions of motion'
    quantities = (
        Quantity('coulomb_asymmetry', 'N m'),
        Quantity('viscous_asymmetry', 'N m s/rad'),
    )
    holds_at_rest = True

    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """Return dtau/d(dFc, dFv) = (|sign(dq)|, |dq|), shape (N, n, P)."""
        return joint_columns(self, motion, np.abs(np.sign(motion.dq)), np.abs(motion.dq))

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return the shift of the dry friction's levels, and the torque that grows with |dq|."""
        coulomb, viscous = scatter(self, values, arm.robot)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(viscous * np.abs(dq))

        levels = DryFriction(np.eye(len(coulomb)), coulomb, coulomb)
        return Action(dry_friction=levels, torque=torque)


@dataclass(frozen=True)
class CoupledJointFriction(Effect):
    """
    Friction and inertia of a shaft that turns with the sum of two joints, as in a wrist drive.

    The joints are pairs (i, k), one after the other. With the shaft's velocity dq_i + dq_k,

        tau_i = Ia ddq_k + Fv dq_k + Fc sign(dq_i + dq_k),
        tau_k = Ia ddq_i + Fv dq_i + Fc sign(dq_i + dq_k);

    the parts of Ia and Fv that act on a joint from its own motion belong to rotor_inertia and
    viscous_friction.
    Source: the model of the Staubli TX40's wrist in Janot, Vandanjon and Gautier 2014.

    """

    name = 'coupled_joint_friction'
    summary = 'friction and inertia of a shaft that turns with the sum of two joints'
    quantities = (
        Quantity('coupled_inertia', 'kg m^2'),
        Quantity('coupled_viscous_coefficient', 'N m s/rad'),
        Quantity('coupled_coulomb_torque', 'N m', lower=0.0),
    )
    holds_at_rest = True

    def __post_init__(self) -> None:
        """Check that the joints are pairs."""
        if not self.joints or len(self.joints) % 2:
            raise ModelError(
                f'{self.name}: joints come in pairs, such as joint_5 and joint_6; '
                f'got {", ".join(self.joints) or "none"}'
            )

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        if robot.n_joints < 2:
            raise ModelError(f'{cls.name}: {robot.name} has one joint only, nothing to couple')
        return robot.joints[-2:]

    @property
    def owners(self) -> tuple[str, ...]:
        """First joint of every pair."""
        return self.joints[::2]

    def _pairs(self, joints: tuple[str, ...]) -> list[tuple[int, int]]:
        columns = self.indices(joints)
        return list(zip(columns[::2], columns[1::2], strict=True))

    def columns(self, motion: Motion, arm: ArmModel) -> FloatArray:
        """Return dtau/d(Ia, Fv, Fc) of every pair, shape (N, n, P)."""
        columns = np.zeros((len(motion), motion.n_joints, 3 * len(self.owners)))
        for position, (i, k) in enumerate(self._pairs(motion.joints)):
            direction = np.sign(motion.dq[:, i] + motion.dq[:, k])
            for row, other in ((i, k), (k, i)):
                columns[:, row, 3 * position] = motion.ddq[:, other]
                columns[:, row, 3 * position + 1] = motion.dq[:, other]
                columns[:, row, 3 * position + 2] = direction
        return columns

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return inertia and damping between the joints, and dry friction of the shaft."""
        n = arm.robot.n_joints
        inertia, damping = np.zeros((n, n)), np.zeros((n, n))
        pairs = self._pairs(arm.robot.joints)
        directions = np.zeros((len(pairs), n))
        coulomb = np.empty(len(pairs))
        for position, (i, k) in enumerate(pairs):
            shaft_inertia, viscous, coulomb[position] = values.reshape(-1, 3)[position]
            inertia[i, k] = inertia[k, i] = shaft_inertia
            damping[i, k] = damping[k, i] = viscous
            directions[position, [i, k]] = 1.0
        return Action(
            damping=damping,
            inertia=inertia,
            dry_friction=DryFriction(directions, -coulomb, coulomb),
        )
