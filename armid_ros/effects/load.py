# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Changes of rigid bodies: payloads, and links that differ from the description."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.effects.action import Action
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.quantities import MIN_Z_SCORE, Quantity
from armid_ros.estimate import ParameterName
from armid_ros.model.rigid_body import LINK_PARAMETERS, LINK_UNITS
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class _LinkBody(Effect):
    """Base class of bodies that are added to links, with ten inertial parameters each."""

    changes_body = True

    def parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Return names and units of the parameters; units do not depend on the joint type."""
        return tuple(
            ParameterName(q.name, owner, q.unit) for owner in self.owners for q in self.quantities
        )

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of each inertial parameter of the bodies, (N, n, P)."""
        return arm.body_columns(motion)[:, :, list(self.adds_to(arm.robot))]

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action whose robot has the added bodies in its links."""
        parameters = arm.robot.rigid_parameters.copy()
        parameters[list(self.adds_to(arm.robot))] += values
        return Action(robot=arm.robot.with_inertias(parameters))

    def spread(self, robot: Robot) -> FloatArray:
        """Return the largest expected errors of the parameters in the description, (P,)."""
        return robot.described_spread.ravel()[list(self.adds_to(robot))]

    def adds_to(self, robot: Robot) -> tuple[int, ...]:
        """Return the indices of the rigid-body parameters that the added bodies change."""
        size = len(LINK_PARAMETERS)
        return tuple(size * joint + i for joint in self.indices(robot.moving) for i in range(size))

    @classmethod
    def _possible_joints(cls, robot: Robot) -> tuple[str, ...]:
        return robot.moving


@dataclass(frozen=True)
class Payload(_LinkBody):
    """
    Body fixed to a link, by default to the last link: mass, first moments and inertia.

    All ten parameters are about the frame of the link's joint. They add to the parameters of the
    link, and the torque is linear in them. They are exactly collinear with the parameters of the
    last link: a payload is identifiable only relative to a known model without it.

    """

    name = 'payload'
    summary = 'a body fixed to a link; all values are about the frame of the joint that moves it'
    quantities = tuple(
        Quantity(
            f'payload_{name}',
            unit,
            lower=0.0 if name == 'm' else -np.inf,
            typical=(0.05, 10.0) if name == 'm' else None,
        )
        for name, unit in zip(LINK_PARAMETERS, LINK_UNITS, strict=True)
    )

    @classmethod
    def _default_joints(cls, robot: Robot) -> tuple[str, ...]:
        return (robot.tip,)

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return all places of a payload: each moving link, by the name of its joint."""
        return tuple((joint,) for joint in robot.moving)

    @classmethod
    def as_change(cls) -> type[Effect]:
        """Return the effect class that models a change of payload; its mass may be negative."""
        return PayloadChange

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether a body within the arm's length can have the fitted parameters."""
        if not self._weighs(values, std, arm):
            return False
        # the inertia of a body about the joint is at least that of a point mass at its centre
        axis = arm.robot.geometry[self.indices(arm.robot.moving)[0]].turn
        x, y, z = axis
        share = np.array([x * x, 2.0 * x * y, y * y, 2.0 * x * z, 2.0 * y * z, z * z])
        if not np.all(std[4:][share != 0.0] > 0.0) or not axis.any():  # noqa: RUF069 - exact zero from the description
            return True
        aside = np.linalg.norm(np.cross(axis, values[1:4])) - MIN_Z_SCORE * np.linalg.norm(
            std[1:4]
        )
        most = share @ values[4:] + MIN_Z_SCORE * np.abs(share) @ std[4:]
        heaviest = np.maximum(values[0] + MIN_Z_SCORE * std[0], 0.0)
        return not most * heaviest < np.maximum(aside, 0.0) ** 2

    def _weighs(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether a positive mass with its centre near the arm is within the errors."""
        if std[0] == 0.0:  # noqa: RUF069 - set exactly to zero if no motion identifies it, as for an inner link
            return bool(np.any(values[1:4]))
        places = [placement.translation for placement in arm.robot.model.jointPlacements]
        # a tool carries its mass within 0.1 m
        length = float(np.sum(np.linalg.norm(places, axis=1))) + 0.1
        heaviest = float(values[0] + MIN_Z_SCORE * std[0])
        return bool(heaviest > 0.0 and np.linalg.norm(values[1:4]) < length * heaviest)

    def spread(self, robot: Robot) -> FloatArray:
        """
        Return the parameters of the largest expected payload, which is as heavy as the arm.

        First moments and inertia are proportional to the mass.

        """
        mass = float(robot.rigid_parameters[:: len(LINK_PARAMETERS)].sum())
        reach = 0.1  # of a mass from its joint [m]
        return np.asarray(mass * np.array([1.0] + 3 * [reach] + 6 * [reach**2]))


@dataclass(frozen=True)
class PayloadChange(Payload):
    """
    Change of the payload on a link; its mass may be negative.

    A negative mass is a payload that was put down, and that the model has as part of the link.

    """

    quantities = tuple(replace(one, lower=-np.inf) for one in Payload.quantities)

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """
        Return whether a load that was picked up or put down can cause the change.

        The load may be heavier than the links, because descriptions often lack the previous load.

        """
        return self._weighs(np.concatenate([np.abs(values[:1]), values[1:]]), std, arm)

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return the change as a payload with the same values."""
        return ((Payload(self.joints), values),)


@dataclass(frozen=True)
class LinkInertia(_LinkBody):
    """
    Difference in mass, first moments and inertia between a link and its description.

    The columns are those of the rigid-body parameters. The effect is identifiable only if the
    other parameters are known; a fit of all parameters absorbs it. For a body on the last link,
    see payload. A first moment turned about the axis of the joint is collinear with an
    encoder_offset.

    """

    name = 'link_inertia'
    summary = 'error of mass, centre or inertia of a link in the description, in its joint frame'
    quantities = tuple(
        Quantity(f'{name}_difference', unit)
        for name, unit in zip(LINK_PARAMETERS, LINK_UNITS, strict=True)
    )

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """
        Return whether the changed link has positive moments of inertia.

        The result is True if the motion does not identify the values separately, or if the link
        had no positive inertia before.

        """
        if not np.all(std[4:] > 0.0):
            return True
        (link,) = self.indices(arm.robot.moving)
        own = arm.robot.rigid_parameters.reshape(-1, len(LINK_PARAMETERS))[link]
        # Ixx, Iyy, Izz
        described, remaining = (
            each[[4, 6, 9]] for each in (own, own + values + MIN_Z_SCORE * std)
        )
        return bool(np.all(remaining > 0.0) or np.any(described <= 0.0))
