# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Coupling of two joints: a shared shaft, a cable, or crosstalk of torque sensors."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, combinations, pairwise, permutations

from armid_ros.effects.action import Action, direction, DryFriction
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.quantities import pair_unit, Quantity
from armid_ros.effects.readings import TorqueReading
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class _Pairs(Effect):
    """Base class of effects on pairs of joints; ``joints`` lists both joints of each pair."""

    def __post_init__(self) -> None:
        """Check that the joints form pairs of two different joints, and that no pair repeats."""
        if not self.joints or len(self.joints) % 2:
            raise ModelError(
                f'{self.name} needs pairs of joints, such as {self.name}@joint_5+joint_6; got '
                f'{", ".join(self.joints) or "no joints"}'
            )
        pairs = list(zip(self.joints[::2], self.joints[1::2], strict=True))
        for first, second in pairs:
            if first == second or pairs.count((first, second)) > 1:
                raise ModelError(
                    f'{self.name}: the pair {first}+{second} is given twice, or has the '
                    'same joint twice'
                )
        super().__post_init__()

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        if robot.n_joints < 2:
            raise ModelError(
                f'{cls.name} needs a pair of joints, but {robot.name} has only one joint'
            )
        return tuple(chain.from_iterable(pairwise(robot.joints)))

    def in_usual_place(self, robot: Robot) -> bool:
        """Return True, because the effect is equally likely on all pairs of joints."""
        return True

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return all pairs of neighbouring joints, as the places where the effect can act."""
        return tuple(pairwise(robot.joints))

    @property
    def owners(self) -> tuple[str, ...]:
        """Names of the first joint of each pair, which stand for the pair in parameter names."""
        return self.joints[::2]

    def parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Return names and units of the parameters, pair by pair."""
        return tuple(
            ParameterName(q.name, first, pair_unit(q.unit, first, second, robot))
            for first, second in zip(self.joints[::2], self.joints[1::2], strict=True)
            for q in self.quantities
        )

    def pairs(self, joints: tuple[str, ...]) -> list[tuple[int, int]]:
        """Return, for each pair of the effect, the indices of its two joints in `joints`."""
        columns = self.indices(joints)
        return list(zip(columns[::2], columns[1::2], strict=True))


@dataclass(frozen=True)
class CoupledJointFriction(_Pairs):
    """
    Friction and inertia of a shaft whose rotation is the sum of two joints, as in a wrist.

    The joints are consecutive pairs (i, k). With the shaft's velocity dq_i + dq_k,

        tau_i = Ia ddq_k + Fv dq_k + Fc sign(dq_i + dq_k),
        tau_k = Ia ddq_i + Fv dq_i + Fc sign(dq_i + dq_k);

    the parts of Ia and Fv that depend on the motion of the joint itself belong to rotor_inertia
    and viscous_friction.
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

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return super()._default_joints(robot)[-2:]

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of shaft inertia, viscous and Coulomb friction, (N, n, P)."""
        columns = np.zeros((len(motion), motion.n_joints, 3 * len(self.owners)))
        for position, (i, k) in enumerate(self.pairs(motion.joints)):
            forwards = direction(motion, (i, k))
            for row, other in ((i, k), (k, i)):
                columns[:, row, 3 * position] = motion.ddq[:, other]
                columns[:, row, 3 * position + 1] = motion.dq[:, other]
                columns[:, row, 3 * position + 2] = forwards
        return columns

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with inertia, damping and dry friction of the shared shafts."""
        n = arm.robot.n_joints
        inertia, damping = np.zeros((n, n)), np.zeros((n, n))
        pairs = self.pairs(arm.robot.joints)
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


@dataclass(frozen=True)
class JointCoupling(_Pairs):
    """
    Elastic coupling of two joints by a cable or a tendon, tau_i = -K q_k and tau_k = -K q_i.

    This is the coupling term of the energy K (q_i - q_k)^2 / 2; its terms in one joint belong to
    joint_spring. K is negative for a crossed cable. Confounded with torque_crosstalk in static
    holds, and with the coupling of the links' weights.

    """

    name = 'joint_coupling'
    summary = 'cable or tendon along two joints: each position causes torque at the other joint'
    quantities = (Quantity('coupling_stiffness', 'N m/rad', typical=(0.1, 50.0)),)

    def __post_init__(self) -> None:
        """Check that no joint is first in two pairs; their parameter names would be equal."""
        super().__post_init__()
        twice = [joint for joint in self.owners if self.owners.count(joint) > 1]
        if twice:
            raise ModelError(
                f'{self.name}: {twice[0]} is the first joint of two pairs; exchange the joints '
                'of one pair'
            )

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return all pairs of joints that may be coupled, each pair in one order only."""
        return tuple(combinations(robot.joints, 2))

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of coupling stiffness of each pair [rad], shape (N, n, P)."""
        q = arm.link_motion(motion).q
        columns = np.zeros((*q.shape, len(self.owners)))
        for position, (i, k) in enumerate(self.pairs(motion.joints)):
            columns[:, i, position] = -q[:, k]
            columns[:, k, position] = -q[:, i]
        return columns


@dataclass(frozen=True)
class TorqueCrosstalk(_Pairs, TorqueReading):
    """
    Crosstalk of torque sensors, reading_i = tau_i + sum of epsilon_ik tau_k.

    The joints are pairs (i, k): the reading of i contains a share of the torque of k; all ordered
    pairs by default. Confounded with first moments and products of inertia of the links; loading
    joint k while joint i rests distinguishes them.

    """

    name = 'torque_crosstalk'
    summary = 'torque of one joint in the reading of another'
    quantities = (Quantity('crosstalk', '', lower=-1.0, upper=1.0, typical=(0.001, 0.05)),)

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        super()._default_joints(robot)  # raises an error if there is only one joint
        return tuple(chain.from_iterable(cls.places(robot)))

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return all ordered pairs: the joint of the sensor, and the joint that disturbs it."""
        return tuple(permutations(robot.joints, 2))

    def parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Return the parameters, named by the joint of the sensor and the disturbing joint."""
        (quantity,) = self.quantities
        return tuple(
            ParameterName(
                f'{quantity.name}_from_{source}',
                reader,
                pair_unit(quantity.unit, reader, source, robot),
            )
            for reader, source in zip(self.joints[::2], self.joints[1::2], strict=True)
        )

    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return torque readings that include shares of other joints' torques, (N, n) [N m]."""
        return tau + tau @ self._shares(values, motion).T

    def transfer(
        self, values: FloatArray, motion: Motion, tau: FloatArray, columns: FloatArray
    ) -> FloatArray:
        """Convert a regressor of true torques to a regressor of readings with crosstalk."""
        return np.asarray(columns + self._shares(values, motion) @ columns)

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the derivatives of the readings by the crosstalk shares, (N, n, P) [N m]."""
        columns = np.zeros((*tau.shape, len(values)))
        for position, (i, k) in enumerate(self.pairs(motion.joints)):
            columns[:, i, position] = tau[:, k]
        return columns

    def _shares(self, values: FloatArray, motion: Motion) -> FloatArray:
        shares = np.zeros((motion.n_joints, motion.n_joints))
        for value, pair in zip(values, self.pairs(motion.joints), strict=True):
            shares[pair] = value
        return shares
