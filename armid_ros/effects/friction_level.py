# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction of all joints that has changed by one factor, as it does with temperature."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from armid_ros.effects.action import Action, DryFriction
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.friction import CoulombFriction, ViscousFriction
from armid_ros.effects.layout import scatter
from armid_ros.effects.quantities import Quantity
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np

_PARTS = ViscousFriction, CoulombFriction


@dataclass(frozen=True)
class FrictionLevel(Effect):
    """
    What several joints have of friction, changed by one factor, tau = k (Fv dq + Fc sign(dq)).

    An arm that is warm has less of it everywhere, and one that stood in the cold more. A search
    looks for that one value and says what it finds as viscous_friction and coulomb_friction.
    Source: Bittencourt and Gunnarsson, Static friction in a robot joint - modeling and
    identification of load and temperature effects, 2012.

    Attributes
    ----------
    viscous, coulomb : tuple of float
        Coefficients Fv and torques Fc that its joints have.

    """

    viscous: tuple[float, ...] = ()
    coulomb: tuple[float, ...] = ()

    name = 'friction_level'
    summary = 'friction of all joints by one factor'
    shown_by = ViscousFriction.shown_by
    look_at = ViscousFriction.look_at
    friction = True
    holds_at_rest = True
    quantities = (Quantity('friction_change', '', lower=-1.0, typical=(0.02, 3.0)),)

    @property
    def owners(self) -> tuple[str, ...]:
        """Return that the arm has the factor once."""
        return ('',)

    @property
    def said_as(self) -> str:
        """Return the part of which there is something."""
        return CoulombFriction.name if any(self.coulomb) else ViscousFriction.name

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/dk, the friction torque that there was [N m], shape (N, n, 1)."""
        places = self.indices(motion.joints)
        dq = motion.dq[:, places]
        columns = np.zeros((len(motion), motion.n_joints, 1))
        columns[:, places, 0] = dq * self.viscous + np.sign(dq) * self.coulomb
        return columns

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return damping and dry friction."""
        viscous, coulomb = (
            scatter(kind(self.joints), values[0] * np.array(own), arm.robot)[0]
            for kind, own in zip(_PARTS, (self.viscous, self.coulomb), strict=True)
        )
        dry = DryFriction(np.eye(len(coulomb)), -coulomb, coulomb)
        return Action(damping=np.diag(viscous), dry_friction=dry)

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return viscous and Coulomb friction of the joints that have any."""
        said = []
        for kind, own in zip(_PARTS, (self.viscous, self.coulomb), strict=True):
            there = np.array(own) != 0.0
            joints = tuple(joint for joint, has in zip(self.joints, there, strict=True) if has)
            if joints:
                said.append((kind(joints), values[0] * np.array(own)[there]))
        return tuple(said)


@dataclass(frozen=True)
class FrictionOfJoints:
    """The friction that an arm has, as a kind of effect: see `FrictionLevel`."""

    effect: FrictionLevel
    name: str = FrictionLevel.name
    changes_body: bool = False

    def on(self, robot: Robot, joints: tuple[str, ...] | None = None) -> Effect:
        """Return the effect, whose joints are those that have friction."""
        return self.effect

    def places(self, robot: Robot) -> tuple[tuple[str, ...], ...]:
        """Return all of its joints together."""
        return (self.effect.joints,)

    def as_change(self) -> FrictionOfJoints:
        """Return itself: the factor is that since the friction was known."""
        return self


def friction_level(
    effects: Iterable[tuple[Effect, FloatArray]], robot: Robot
) -> tuple[FrictionOfJoints, ...]:
    """Return what is to be looked for where effects with values give joints friction; or none."""
    levels = np.zeros((len(_PARTS), robot.n_joints))
    for effect, values in effects:
        for level, kind in zip(levels, _PARTS, strict=True):
            if isinstance(effect, kind):
                level += scatter(effect, values, robot)[0]
    there = np.flatnonzero(levels.any(axis=0))
    if len(there) < 2:
        return ()
    viscous, coulomb = (tuple(level[there].tolist()) for level in levels)
    joints = tuple(robot.joints[k] for k in there)
    return (FrictionOfJoints(FrictionLevel(joints, viscous=viscous, coulomb=coulomb)),)
