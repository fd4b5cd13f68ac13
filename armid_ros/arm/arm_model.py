# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An arm: a rigid body plus a list of effects with their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.effects import Action, DryFriction, Effect
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.model import (
    BaseParameters,
    group_columns,
    inverse_dynamics,
    random_motion,
    regressor,
    rigid_parameter_names,
)
from armid_ros.motion import FloatArray, Motion, read_only
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class ArmModel:
    """
    A rigid body plus effects: tau = Y pi + sum over effects of tau_e(motion; theta_e).

    Attributes
    ----------
    robot : Robot
        The rigid body, with its inertial parameters and its gravity.
    effects : tuple of Effect
        What else acts.
    values : tuple of ndarray, each of shape (P_e,)
        Parameter values of every effect, zero by default.
    quasi_static : bool
        Whether the rigid body is felt by its weight alone, as in motions slow enough for inertia
        not to matter: tau = Y(q, 0, 0) pi + effects.

    """

    robot: Robot
    effects: tuple[Effect, ...] = ()
    values: tuple[FloatArray, ...] = ()
    quasi_static: bool = False

    def __post_init__(self) -> None:
        """Fill in zeros, freeze the values and check their number."""
        sizes = [len(effect.parameters(self.robot)) for effect in self.effects]
        values = self.values or tuple(np.zeros(size) for size in sizes)
        object.__setattr__(self, 'values', tuple(read_only(v) for v in values))
        if [v.shape for v in self.values] != [(size,) for size in sizes]:
            raise ModelError(
                f'{self.robot.name}: effects {", ".join(e.name for e in self.effects)} take '
                f'{sizes} values, got shapes {[v.shape for v in self.values]}'
            )

    def with_effect(self, effect: Effect, values: npt.ArrayLike | None = None) -> ArmModel:
        """Return the arm with one more effect; without values its parameters are zero."""
        if values is None:
            values = np.zeros(len(effect.parameters(self.robot)))
        array = np.asarray(values, dtype=float)
        return replace(self, effects=(*self.effects, effect), values=(*self.values, array))

    @property
    def parameters(self) -> tuple[ParameterName, ...]:
        """Standard parameters: 10 n rigid ones, then those of the effects, P in all."""
        names = list(rigid_parameter_names(self.robot))
        for effect in self.effects:
            names.extend(effect.parameters(self.robot))
        return tuple(names)

    @property
    def theta(self) -> FloatArray:
        """Values of the standard parameters, shape (P,)."""
        return np.concatenate([self.robot.rigid_parameters, *self.values])

    def with_theta(self, theta: npt.ArrayLike) -> ArmModel:
        """Return the same structure with other standard parameters, shape (P,)."""
        theta = np.asarray(theta, dtype=float)
        size = len(self.robot.rigid_parameters)
        cuts = np.cumsum([size, *(len(v) for v in self.values)])
        parts = np.split(theta, cuts)[:-1]
        return replace(self, robot=self.robot.with_inertias(parts[0]), values=tuple(parts[1:]))

    def effect_columns(self, motion: Motion) -> FloatArray:
        """Return the sensitivities of the effects, shape (N, n, P - 10 n)."""
        blocks = [effect.columns(motion, self) for effect in self.effects]
        empty = np.empty((len(motion), motion.n_joints, 0))
        return np.concatenate([empty, *blocks], axis=2)

    def columns(self, motion: Motion) -> FloatArray:
        """Return the sensitivities of the torques to ``parameters``, shape (N, n, P)."""
        rigid = regressor(self.robot, self._felt(motion))
        return np.concatenate([rigid, self.effect_columns(motion)], axis=2)

    def action(self) -> Action:
        """Return how the robot and all effects together act on the plant."""
        robot = self.robot
        actions = []
        for effect, values in zip(self.effects, self.values, strict=True):
            actions.append(effect.action(values, replace(self, robot=robot)))
            robot = actions[-1].robot or robot
        torques = [a.torque for a in actions if a.torque is not None]

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(sum(f(t, q, dq) for f in torques))

        zero = np.zeros((robot.n_joints, robot.n_joints))
        return Action(
            damping=sum((a.damping for a in actions if a.damping is not None), zero),
            inertia=sum((a.inertia for a in actions if a.inertia is not None), zero),
            dry_friction=_merge([a.dry_friction for a in actions if a.dry_friction is not None]),
            torque=torque if torques else None,
            robot=robot,
        )

    def torque(self, motion: Motion) -> FloatArray:
        """
        Predict the joint torques of a motion, all effects included exactly.

        Returns
        -------
        ndarray, shape (N, n)
            Actuator torque [N m].

        """
        action = self.action()
        assert action.robot is not None and action.damping is not None
        assert action.inertia is not None
        tau = inverse_dynamics(action.robot, self._felt(motion))
        tau += motion.dq @ action.damping.T + motion.ddq @ action.inertia.T
        if action.dry_friction is not None:
            tau += action.dry_friction.torque(motion.dq)
        if action.torque is not None:
            tau += action.torque(motion.t, motion.q, motion.dq)
        return tau

    def _felt(self, motion: Motion) -> Motion:
        return motion.at_rest() if self.quasi_static else motion

    def base_parameters(self, rng: np.random.Generator) -> BaseParameters:
        """Find the combinations of all standard parameters that any motion can tell apart."""
        motion = random_motion(self.robot, 40 * self.robot.n_joints, rng)
        columns = self.columns(motion)
        return group_columns(columns.reshape(-1, columns.shape[-1]), self.parameters)


def _merge(elements: Sequence[DryFriction]) -> DryFriction | None:
    """Stack friction elements; those along the same direction become one with summed levels."""
    if not elements:
        return None
    directions = np.vstack([e.directions for e in elements])
    lower = np.concatenate([e.lower for e in elements])
    upper = np.concatenate([e.upper for e in elements])
    unique, inverse = np.unique(directions, axis=0, return_inverse=True)
    sums = np.zeros((2, len(unique)))
    np.add.at(sums[0], inverse.ravel(), lower)
    np.add.at(sums[1], inverse.ravel(), upper)
    active = np.any(sums != 0.0, axis=0)
    return DryFriction(unique[active], sums[0, active], sums[1, active])
