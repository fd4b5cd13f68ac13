# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bodies: what an arm carries, and links that are not as described."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.effects.action import Action
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.quantities import Quantity, SURELY
from armid_ros.estimate import ParameterName
from armid_ros.model.rigid_body import LINK_PARAMETERS, LINK_UNITS
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

#: How far from its joint a link's mass may be without a word in the description [m].
_REACH = 0.1
#: Moments of inertia among the parameters of a link: Ixx, Iyy, Izz.
_MOMENTS = 4, 6, 9


@dataclass(frozen=True)
class _LinkBody(Effect):
    """Ten inertial parameters about the frame of a link's joint, added to the link's own."""

    changes_body = True

    def parameters(self, robot: Robot) -> tuple[ParameterName, ...]:
        """Name them; a body has the same units on a joint that slides."""
        return tuple(
            ParameterName(q.name, owner, q.unit) for owner in self.owners for q in self.quantities
        )

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the links' own columns of the regressor, shape (N, n, P)."""
        return arm.body_columns(motion)[:, :, list(self.adds_to(arm.robot))]

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the robot with the parameters added to its links."""
        parameters = arm.robot.rigid_parameters.copy()
        parameters[list(self.adds_to(arm.robot))] += values
        return Action(robot=arm.robot.with_inertias(parameters))

    def spread(self, robot: Robot, found: Sequence[FloatArray] | None = None) -> FloatArray:
        """Return what descriptions of the links are off by at the most, shape (P,)."""
        return described_spread(robot).ravel()[list(self.adds_to(robot))]

    def adds_to(self, robot: Robot) -> tuple[int, ...]:
        """Return the parameters of its links."""
        size = len(LINK_PARAMETERS)
        return tuple(size * joint + i for joint in self.indices(robot.joints) for i in range(size))


def described_spread(robot: Robot) -> FloatArray:
    """
    Return how far rigid parameters may be from their description, shape (n, 10).

    It is believed to a factor or so, and where it gives nothing, a tenth of a mean link is there.

    """
    body = np.abs(robot.rigid_parameters.reshape(-1, len(LINK_PARAMETERS)))
    mass = body[:, :1] + 0.1 * np.mean(body[:, :1])
    return np.asarray(body + mass * np.array([[1.0] + 3 * [_REACH] + 6 * [_REACH**2]]))


@dataclass(frozen=True)
class Payload(_LinkBody):
    """
    A body fixed to a link, the last one by default: mass, first moments and inertia.

    All ten are about the frame of the link's joint, so they add to the link's own and are linear.
    They are exactly collinear with the parameters of the last link: a payload is identifiable only
    against a model that is known without it.

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
        return robot.joints[-1:]

    @classmethod
    def places(cls, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return all links: any may carry something that is none of its own mass."""
        return tuple((joint,) for joint in robot.joints)

    @classmethod
    def as_change(cls) -> type[Effect]:
        """Return a load that may have been put down."""
        return PayloadChange

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether a body may have such values, not farther away than the arm is long."""
        return self._weighs(values, std, arm) and not self._is_no_body(values, std, arm)

    def _weighs(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether it may weigh something, not farther away than the arm is long."""
        if std[0] == 0.0:  # noqa: RUF069 - set where no motion shows it, as of an inner link
            return bool(np.any(values[1:4]))
        places = [placement.translation for placement in arm.robot.model.jointPlacements]
        length = float(np.sum(np.linalg.norm(places, axis=1))) + _REACH
        heaviest = float(values[0] + SURELY * std[0])
        return bool(heaviest > 0.0 and np.linalg.norm(values[1:4]) < length * heaviest)

    def _is_no_body(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether no body can have such values, as far as the motion tells them."""
        # about the joint its inertia is no less than that of its mass in one point, at its centre
        axis = arm.robot.geometry[self.indices(arm.robot.joints)[0]].turn
        x, y, z = axis
        share = np.array([x * x, 2.0 * x * y, y * y, 2.0 * x * z, 2.0 * y * z, z * z])
        if not np.all(std[4:][share != 0.0] > 0.0) or not axis.any():  # noqa: RUF069 - an axis as described
            return False
        aside = np.linalg.norm(np.cross(axis, values[1:4])) - SURELY * np.linalg.norm(std[1:4])
        most = share @ values[4:] + SURELY * np.abs(share) @ std[4:]
        heaviest = np.maximum(values[0] + SURELY * std[0], 0.0)
        return bool(most * heaviest < np.maximum(aside, 0.0) ** 2)

    def spread(self, robot: Robot, found: Sequence[FloatArray] | None = None) -> FloatArray:
        """
        Return what an arm may carry at the most: as much as it weighs, a little off, shape (P,).

        First moments and inertia go with the mass: a light load has no large ones.

        """
        mass = float(robot.rigid_parameters[:: len(LINK_PARAMETERS)].sum())
        if found is not None:
            values, std = found
            mass = min(mass, float(np.abs(values[0]) + SURELY * std[0]))
        return np.asarray(mass * np.array([1.0] + 3 * [_REACH] + 6 * [_REACH**2]))


@dataclass(frozen=True)
class PayloadChange(Payload):
    """
    Difference of what a link holds from what it held, which may be nothing now.

    A payload of less than nothing was put down: the model has it in the link that held it.

    """

    quantities = tuple(replace(one, lower=-np.inf) for one in Payload.quantities)

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """
        Return whether what was taken or put down may be called a load.

        It may weigh more than the links: a description often lacks what the arm held before.

        """
        return self._weighs(np.concatenate([np.abs(values[:1]), values[1:]]), std, arm)

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return the payload."""
        return ((Payload(self.joints), values),)


@dataclass(frozen=True)
class LinkInertia(_LinkBody):
    """
    Difference of a link's mass, first moments and inertia from the description's.

    The same directions as the rigid parameters themselves: visible against a model whose other
    values are trusted, and swallowed by a fit of all of them. For a body put onto the last link
    see payload; a first moment turned about the joint's axis is an encoder_offset as well.

    """

    name = 'link_inertia'
    summary = 'mass, centre or inertia of a link other than described, in the frame of its joint'
    quantities = tuple(
        Quantity(f'{name}_difference', unit)
        for name, unit in zip(LINK_PARAMETERS, LINK_UNITS, strict=True)
    )

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """
        Return whether what is left of the link has no inertia of less than nothing.

        Nothing is said where values stand for others that the motion does not tell from them, nor
        of links that a fit has left without such an inertia before.

        """
        if not np.all(std[4:] > 0.0):
            return True
        (link,) = self.indices(arm.robot.joints)
        own = arm.robot.rigid_parameters.reshape(-1, len(LINK_PARAMETERS))[link]
        there, left = (each[list(_MOMENTS)] for each in (own, own + values + SURELY * std))
        return bool(np.all(left > 0.0) or np.any(there <= 0.0))
