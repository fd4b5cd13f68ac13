# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction that depends on velocity: viscous, Coulomb, what these leave out, and its level."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from typing import ClassVar

from armid_ros.effects.action import Action, DryFriction, merge_actions
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.direction import direction
from armid_ros.effects.layout import joint_columns, scatter
from armid_ros.effects.quantities import Quantity, Shape, SURELY
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class ViscousFriction(Effect):
    """
    Friction torque proportional to joint velocity, tau = Fv dq.

    Confounded with back-EMF (motor-side data) and, at a single frequency, with a torque delay.
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994.

    """

    name = 'viscous_friction'
    summary = 'torque proportional to joint velocity'
    quantities = (Quantity('viscous_coefficient', 'N m s/rad', lower=0.0, typical=(0.004, 10.0)),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/dFv = dq [rad/s], shape (N, n, P)."""
        return joint_columns(self, motion, motion.dq)

    def action(self, values: FloatArray, arm: Arm) -> Action:
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
    quantities = (Quantity('coulomb_torque', 'N m', lower=0.0, typical=(0.005, 10.0)),)
    holds_at_rest = True

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/dFc = sign(dq) [-], shape (N, n, P)."""
        return joint_columns(self, motion, direction(motion))

    def action(self, values: FloatArray, arm: Arm) -> Action:
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
        Quantity('coulomb_asymmetry', 'N m', typical=(0.005, 2.0)),
        Quantity('viscous_asymmetry', 'N m s/rad', typical=(0.002, 5.0)),
    )
    holds_at_rest = True

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether what is known of friction still opposes motion in both directions."""
        friction = arm.action().dry_friction
        if friction is None:
            return True
        known = friction.largest(np.zeros(arm.robot.n_joints))
        shift, doubt = (np.abs(scatter(self, each, arm.robot)[0]) for each in (values, std))
        return bool(np.all(shift <= known + SURELY * doubt))

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/d(dFc, dFv) = (|sign(dq)|, |dq|), shape (N, n, P)."""
        forwards = direction(motion)
        return joint_columns(self, motion, forwards**2, forwards * motion.dq)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the shift of the dry friction's levels, and the torque that grows with |dq|."""
        coulomb, viscous = scatter(self, values, arm.robot)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(viscous * np.abs(dq))

        levels = DryFriction(np.eye(len(coulomb)), coulomb, coulomb)
        return Action(dry_friction=levels, torque=torque)


@dataclass(frozen=True)
class QuadraticFriction(Effect):
    """
    Friction torque that grows with the square of the joint velocity, tau = Fq dq |dq|.

    Drag of air or oil where Fq is positive; with viscous friction, a negative one is the
    flattening at high speed that grease in strain-wave gears shows. Confounded with
    stribeck_friction, whose curvature lies at low speed, and with saturation of the drive; a wider
    range of speeds tells.
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994, section 3.

    """

    name = 'quadratic_friction'
    summary = 'friction that grows with the square of the velocity, or flattens'
    quantities = (Quantity('quadratic_coefficient', 'N m s^2/rad^2', typical=(0.0004, 1.0)),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/dFq = dq |dq| [rad^2/s^2], shape (N, n, P)."""
        return joint_columns(self, motion, motion.dq * np.abs(motion.dq))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the torque."""
        (quadratic,) = scatter(self, values, arm.robot)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(quadratic * dq * np.abs(dq))

        return Action(torque=torque)


@dataclass(frozen=True)
class StribeckFriction(Effect):
    """
    Friction beyond Coulomb's that lubrication takes away as the joint gets faster.

    tau = dFs exp(-|dq / vs|^d) sign(dq), where dFs = Fs - Fc is the breakaway torque beyond the
    Coulomb torque. The hump lies below 3 vs. Confounded with presliding_hysteresis, with the
    curvature of quadratic_friction, and with a velocity that was filtered too much at reversals;
    constant velocities from 0.01 to 2 rad/s in both directions tell them apart.
    Source: Bo and Pavelescu 1982; Armstrong-Helouvry, Dupont and Canudas de Wit 1994.

    """

    name = 'stribeck_friction'
    summary = 'breakaway torque beyond Coulomb friction, gone at higher velocity'
    quantities = (Quantity('stribeck_torque', 'N m', lower=0.0, typical=(0.001, 10.0)),)
    shapes = (
        Shape('stribeck_velocity', 'rad/s', 1e-4, 20.0, 0.1, (0.01, 0.03, 0.1, 0.3, 1.0)),
        Shape('stribeck_exponent', '', 0.3, 4.0, 2.0, (1.0, 2.0)),
    )
    holds_at_rest = True

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/ddFs = exp(-|dq / vs|^d) sign(dq) [-], shape (N, n, P)."""
        return joint_columns(self, motion, self._left(motion.dq, arm) * direction(motion))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return dry friction of the breakaway torque, and what motion takes away of it."""
        (breakaway,) = scatter(self, values, arm.robot)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(breakaway * (self._left(dq, arm) - 1.0) * np.sign(dq))

        dry = DryFriction(np.eye(len(breakaway)), -breakaway, breakaway)
        return Action(dry_friction=dry, torque=torque)

    def _left(self, dq: FloatArray, arm: Arm) -> FloatArray:
        """Return the share of the breakaway torque that remains at a velocity."""
        velocity, exponent = self.shape_over_joints(arm.robot)
        return np.asarray(np.exp(-(np.abs(dq / velocity) ** exponent)))


@dataclass(frozen=True)
class ThermalFriction(Effect):
    """
    Viscous friction that changes while the joint warms up, tau = dFv (1 - exp(-t / T)) dq.

    Time counts from the beginning of the recording; dFv is negative where grease gets thin, by 20
    to 60 % of the cold coefficient. Two equal periods differ by it, which tells it from every
    effect that depends on velocity alone; torque_drift differs as well, but not with velocity.
    Source: Bittencourt, Wernholt, Sander-Tavallaey and Brogardh 2010, in the form of one time
    constant.

    """

    name = 'thermal_friction'
    summary = 'viscous friction that changes while the joint warms up'
    quantities: ClassVar[tuple[Quantity, ...]] = (
        Quantity('viscous_change', 'N m s/rad', typical=(0.001, 6.0)),
    )
    shapes = (Shape('warm_up_time', 's', 0.1, 1e5, 600.0, (10.0, 60.0, 300.0, 1000.0, 3000.0)),)

    @classmethod
    def as_change(cls) -> type[Effect]:
        """Return friction that may have been another one from the beginning."""
        return ThermalChange

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/ddFv = (1 - exp(-t / T)) dq [rad/s], shape (N, n, P)."""
        return joint_columns(self, motion, self._warm(motion.t, arm) * motion.dq)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the torque."""
        (change,) = scatter(self, values, arm.robot)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return np.asarray(change * self._warm(t, arm) * dq)

        return Action(torque=torque)

    def _warm(self, t: FloatArray, arm: Arm) -> FloatArray:
        (constant,) = self.shape_over_joints(arm.robot)
        return np.asarray(-np.expm1(-np.asarray(t)[..., np.newaxis] / constant))


@dataclass(frozen=True)
class ThermalChange(ThermalFriction):
    """
    Viscous friction other than it was, from the beginning and while the joint warms up.

    tau = (c + dFv (1 - exp(-t / T))) dq. A joint that starts colder has more friction at first,
    and as much in the end. Said as thermal_friction and viscous_friction.

    """

    name = 'thermal_change'
    quantities = (*ThermalFriction.quantities, replace(*ViscousFriction.quantities, lower=-np.inf))

    @property
    def said_as(self) -> str:
        """Return the change while the joint warms up."""
        return ThermalFriction.name

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/ddFv and dtau/dc [rad/s], shape (N, n, P)."""
        return joint_columns(self, motion, self._warm(motion.t, arm) * motion.dq, motion.dq)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return what both do."""
        both = self.named_as(values, arm)
        return merge_actions(arm.robot, [part.action(own, arm) for part, own in both])

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return both."""
        change, first = values.reshape(-1, 2).T
        return (
            (ThermalFriction(self.joints, self.shape), change),
            (ViscousFriction(self.joints), first),
        )


#: What has a factor in common where all of the friction changes.
_PARTS = ViscousFriction, CoulombFriction


@dataclass(frozen=True)
class FrictionLevel(Effect):
    """
    What several joints have of friction, changed by one factor, tau = k (Fv dq + Fc sign(dq)).

    An arm that is warm has less of it everywhere, and one that stood in the cold more, above all
    of viscous friction. A search looks for one value, of both or of the viscous part; it is fitted
    with a factor for each joint, as no two warm up alike, and said as friction of its kinds.
    Source: Bittencourt and Gunnarsson, Static friction in a robot joint - modeling and
    identification of load and temperature effects, 2012.

    Attributes
    ----------
    viscous, coulomb : tuple of float
        Coefficients Fv and torques Fc that its joints have.
    each : bool
        Whether each joint has a factor of its own.

    """

    viscous: tuple[float, ...] = ()
    coulomb: tuple[float, ...] = ()
    each: bool = False

    name = 'friction_level'
    summary = 'friction of all joints by one factor'
    holds_at_rest = True
    quantities = (Quantity('friction_change', '', lower=-1.0, typical=(0.02, 3.0)),)

    @property
    def owners(self) -> tuple[str, ...]:
        """Return what has a factor: the joints, or the arm once."""
        return self.joints if self.each else ('',)

    @property
    def said_as(self) -> str:
        """Return the part of which there is something."""
        return CoulombFriction.name if any(self.coulomb) else ViscousFriction.name

    def when_found(self, values: FloatArray) -> tuple[Effect, FloatArray]:
        """Return the same with a factor of its own for each joint."""
        return replace(self, each=True), np.resize(values, len(self.joints))

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/dk, the friction torque that there was [N m], shape (N, n, P)."""
        of_joints = [kind(self.joints).columns(motion, arm) * own for kind, own in self._parts]
        each = np.sum(of_joints, axis=0)
        return np.asarray(each if self.each else each.sum(axis=2, keepdims=True))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return damping and dry friction."""
        viscous, coulomb = (
            kind(self.joints).action(values * own, arm) for kind, own in self._parts
        )
        return Action(damping=viscous.damping, dry_friction=coulomb.dry_friction)

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return viscous and Coulomb friction of the joints that have any."""
        said: list[tuple[Effect, FloatArray]] = []
        for kind, own in self._parts:
            there = own != 0.0  # noqa: RUF069 - as described
            joints = tuple(joint for joint, has in zip(self.joints, there, strict=True) if has)
            if joints:
                said.append((kind(joints), (values * own)[there]))
        return tuple(said)

    @property
    def _parts(self) -> tuple[tuple[type[Effect], FloatArray], ...]:
        """Kinds of friction, and what each joint has of them, (n,)."""
        levels = (np.array(own) for own in (self.viscous, self.coulomb))
        return tuple(zip(_PARTS, levels, strict=True))


@dataclass(frozen=True)
class FrictionOfJoints:
    """The friction that an arm has, as a kind of effect: see `FrictionLevel`."""

    effect: FrictionLevel
    name: str = FrictionLevel.name

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
    effects: Iterable[tuple[Effect, FloatArray]], robot: Robot, library: Collection[str]
) -> tuple[FrictionOfJoints, ...]:
    """
    Return what is to be looked for where effects with values give two joints friction or more.

    Parameters
    ----------
    effects : iterable of (Effect, ndarray)
        What the arm has, with values.
    robot : Robot
        The arm.
    library : collection of str
        Names that may be given: both kinds of friction have to be among them.

    """
    if not {kind.name for kind in _PARTS} <= set(library):
        return ()
    levels = np.zeros((len(_PARTS), robot.n_joints))
    for effect, values in effects:
        for level, kind in zip(levels, _PARTS, strict=True):
            if isinstance(effect, kind):
                level += scatter(effect, values, robot)[0]
    found: list[FrictionOfJoints] = []
    for some in (levels, levels * [[1.0], [0.0]])[: 2 if levels[1].any() else 1]:
        there = np.flatnonzero(some.any(axis=0))
        if len(there) >= 2:
            joints = tuple(robot.joints[k] for k in there)
            viscous, coulomb = (tuple(level[there].tolist()) for level in some)
            found.append(FrictionOfJoints(FrictionLevel(joints, viscous=viscous, coulomb=coulomb)))
    return tuple(found)
