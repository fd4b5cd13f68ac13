# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction that depends on velocity: viscous, Coulomb, and what these two leave out."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.effects.action import Action, DryFriction
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.layout import joint_columns, scatter, smooth_joint_columns
from armid_ros.effects.quantities import Quantity, Shape, SURELY
from armid_ros.effects.smooth import smooth_direction, SmoothColumns
from armid_ros.motion import FloatArray, Motion
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
    shown_by = 'constant velocities, slow to fast, in both directions'
    look_at = 'the grease, its temperature, the seals and the bearings'
    friction = True
    familiar = True
    nuisance = ((),)
    urdf_attribute = mjcf_attribute = 'damping'
    usual = True
    everywhere = True
    quantities = (Quantity('viscous_coefficient', 'N m s/rad', lower=0.0, typical=(0.004, 10.0)),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/dFv = dq [rad/s], shape (N, n, P)."""
        return joint_columns(self, motion, motion.dq)

    def smooth_columns(self, motion: Motion, width: FloatArray) -> SmoothColumns:
        """Return the same with its gradient."""
        return smooth_joint_columns(self, motion, (motion.dq, 1, np.ones_like(motion.dq)))

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
    shown_by = 'slow constant velocity in both directions'
    look_at = 'the brake, the seals and the bearings, and whether it moves freely by hand'
    friction = True
    familiar = True
    nuisance = ((),)
    urdf_attribute = 'friction'
    mjcf_attribute = 'frictionloss'
    usual = True
    everywhere = True
    quantities = (Quantity('coulomb_torque', 'N m', lower=0.0, typical=(0.005, 10.0)),)
    holds_at_rest = True

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/dFc = sign(dq) [-], shape (N, n, P)."""
        return joint_columns(self, motion, np.sign(motion.dq))

    def smooth_columns(self, motion: Motion, width: FloatArray) -> SmoothColumns:
        """Return the same with a smooth direction."""
        return smooth_joint_columns(self, motion, smooth_direction(motion.dq, width))

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
    shown_by = 'static holds beside slow motion in both directions'
    look_at = 'the brake, the gear, and cables that pull one way'
    friction = True
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
        return joint_columns(self, motion, np.abs(np.sign(motion.dq)), np.abs(motion.dq))

    def smooth_columns(self, motion: Motion, width: FloatArray) -> SmoothColumns:
        """Return the same with a smooth direction."""
        sign, _, slope = smooth_direction(motion.dq, width)
        return smooth_joint_columns(
            self,
            motion,
            (sign**2, 1, 2.0 * sign * slope),
            (sign * motion.dq, 1, sign + motion.dq * slope),
        )

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
    shown_by = 'constant velocities up to the limit'
    look_at = 'what moves through air, oil or grease'
    friction = True
    familiar = True
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
    shown_by = 'constant velocities from 0.01 to 1 rad/s in both directions'
    look_at = 'the kind, the age and the temperature of the grease'
    friction = True
    familiar = True
    nuisance = ((0.03, 2.0), (0.1, 2.0), (0.3, 2.0))  # humps at low velocities
    quantities = (Quantity('stribeck_torque', 'N m', lower=0.0, typical=(0.001, 10.0)),)
    shapes = (
        Shape('stribeck_velocity', 'rad/s', 1e-4, 20.0, 0.1, (0.01, 0.03, 0.1, 0.3, 1.0)),
        Shape('stribeck_exponent', '', 0.3, 4.0, 2.0, (1.0, 2.0)),
    )
    holds_at_rest = True

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return dtau/ddFs = exp(-|dq / vs|^d) sign(dq) [-], shape (N, n, P)."""
        return joint_columns(self, motion, self._left(motion.dq, arm) * np.sign(motion.dq))

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
    shown_by = 'the same motion cold and after half an hour of work'
    look_at = 'how warm the gear was, and how long the arm had worked before'
    friction = True
    quantities = (Quantity('viscous_change', 'N m s/rad', typical=(0.001, 6.0)),)
    shapes = (Shape('warm_up_time', 's', 0.1, 1e5, 600.0, (10.0, 60.0, 300.0, 1000.0, 3000.0)),)

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
