# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Springs between a link and a machine or person whose motion was recorded too.

The springs are those of ``interaction``. Their anchors are known: points of ``Motion.partner``
with the names of the ties. Therefore neither attachments nor anchors are estimated.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

from armid_ros.effects.base import Arm, Effect, Unexplained
from armid_ros.effects.interaction import Anchor, Attached, HumanInteraction, InterfaceSlack
from armid_ros.errors import ModelError
from armid_ros.files import finite
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
from armid_ros.robots.ties import Tie
import numpy as np
from scipy.interpolate import CubicHermiteSpline


@dataclass(frozen=True)
class Tied(Attached):
    """
    Base class of springs between an arm and moving points of another machine or a person.

    Attributes
    ----------
    ties : tuple of Tie
        The ties, one on each joint.
    partner : str
        The description of the other machine: a shipped name or a path.
    anchor : callable, or None
        Function that returns the points along a motion; see `along`.

    """

    ties: tuple[Tie, ...] = ()
    partner: str = ''
    anchor: Anchor | None = None

    @classmethod
    def of(
        cls, robot: Robot, ties: Sequence[Tie], partner: str, joints: Sequence[str] | None = None
    ) -> Self:
        """
        Create the springs on given joints of a robot, by default on all joints with a tie.

        Raises
        ------
        ModelError
            If a joint has no tie, or two ties, whose parameter names would be equal.

        """
        by_joint: dict[str, Tie] = {}
        for tie in ties:
            if tie.joint in by_joint:
                raise ModelError(
                    f'{cls.name}: joint {tie.joint} has two ties; only one per joint is '
                    'identifiable, so remove the other'
                )
            by_joint[tie.joint] = tie
        chosen = tuple(by_joint if joints is None else joints)
        for joint in chosen:
            if joint not in by_joint:
                raise ModelError(
                    f"{cls.name}: joint '{joint}' has no tie; joints with a tie are "
                    f'{", ".join(by_joint)}'
                )
            robot.index(joint)
        return cls(chosen, ties=tuple(by_joint[joint] for joint in chosen), partner=partner)

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points of the other machine to which springs connect the arm."""
        return tuple(tie.name for tie in self.ties)

    def along(self, motion: Motion) -> Self:
        """
        Return a copy of the springs with the recorded motion of their anchors.

        Raises
        ------
        ModelError
            If the points of the other machine were not recorded with the motion.

        """
        partner, names = motion.partner, self.points
        if partner is None or not set(names) <= set(partner.names):
            raise ModelError(
                f'{self.name} of {", ".join(self.joints)}: the motion of the points '
                f'{", ".join(names)} on the other machine is not known; give the description of '
                f'that machine ({self.partner or "URDF"}) with --partner'
            )
        columns = [partner.names.index(name) for name in names]
        position, velocity = partner.position[:, columns], partner.velocity[:, columns]
        curve = CubicHermiteSpline(motion.t, position, velocity)
        return replace(self, anchor=lambda t: (curve(t), curve(t, 1)))

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the joint torque per unit of each parameter of every spring, shape (N, n, P)."""
        return Attached.columns(self.along(motion), motion, arm)

    @property
    def _attachments(self) -> FloatArray:
        return np.array([tie.point for tie in self.ties]).reshape(-1, 3)

    def _anchor(self, arm: Arm) -> Anchor:
        def unknown(t: FloatArray) -> tuple[FloatArray, FloatArray]:
            raise ModelError(
                f'{self.name} of {", ".join(self.joints)} needs the recorded motion of '
                f'{self.partner or "a second machine"}; to simulate, remove the effect'
            )

        return self.anchor or unknown

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """Return start values of the slacks of straps; their anchors are known."""
        return Attached.shape_starts(self, unexplained, arm)

    def _default_shape(self, robot: Robot) -> FloatArray:
        return self.shape_values

    def particulars(self) -> dict[str, Any]:
        """Return the entries for model.yaml: the other machine, and end points of the springs."""
        rows = [
            {
                'name': tie.name,
                'joint': tie.joint,
                'point': list(tie.point),
                'partner_joint': tie.other_joint,
                'partner_point': list(tie.other_point),
            }
            for tie in self.ties
        ]
        return {'partner': self.partner, 'ties': rows}


@dataclass(frozen=True)
class TiedInteraction(Tied, HumanInteraction):
    """Spring and damper between a link and a point of another machine with recorded motion."""

    quantities = HumanInteraction.quantities[:2]
    shapes = ()


@dataclass(frozen=True)
class TiedSlack(Tied, InterfaceSlack):
    """Strap between a link and a point of another machine with recorded motion."""

    # start values [m]; straps stretch by millimetres
    shapes = (
        replace(InterfaceSlack.shapes[-1], default=0.003, grid=(0.001, 0.002, 0.004, 0.008)),
    )


def tied_as_written(entry: Mapping[str, Any], robot: Robot) -> Tied:
    """
    Create the springs between an arm and another machine from an entry of model.yaml.

    Raises
    ------
    ModelError
        If effects of that name are not tied, or the springs are impossible; see `Tied.of`.
    ValueError
        If a coordinate is not a number.

    """
    known = {kind.name: kind for kind in (TiedInteraction, TiedSlack)}
    name = str(entry['name'])
    if name not in known:
        raise ModelError(f"model.yaml: {name} cannot have 'ties'; only {', '.join(known)} can")

    def point(values: Sequence[float]) -> tuple[float, float, float]:
        x, y, z = (finite(value, 'a coordinate of a tie') for value in values)
        return x, y, z

    ties = [
        Tie(
            str(row['name']),
            str(row['joint']),
            str(row['partner_joint']),
            point(row['point']),
            point(row['partner_point']),
        )
        for row in entry['ties']
    ]
    return known[name].of(robot, ties, str(entry['partner']), entry['joints'])


@dataclass(frozen=True)
class Partner:
    """
    Second machine, and the springs that may connect the arm to this machine.

    Attributes
    ----------
    robot : Robot
        Its description; its base frame is that of the arm.
    ties : tuple of Tie
        Possible springs, at most one on each joint of the arm.
    source : str
        The description's shipped name or path.

    """

    robot: Robot
    ties: tuple[Tie, ...]
    source: str = ''

    def tied(self, arm: Robot, joints: Sequence[str] | None = None, *, slack: bool) -> Effect:
        """Create springs (straps if `slack`) on the given joints, or on all joints with ties."""
        kind = TiedSlack if slack else TiedInteraction
        return kind.of(arm, self.ties, self.source or self.robot.name, joints)
