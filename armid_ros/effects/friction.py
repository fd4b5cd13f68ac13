# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction that depends on velocity: viscous, Coulomb, Stribeck, quadratic and thermal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

from armid_ros.effects.action import Action, direction, DryFriction
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.joint_law import joint_columns, JointLaw, JointStates, scatter
from armid_ros.effects.quantities import MIN_Z_SCORE, Quantity, Shape
from armid_ros.files import finite
from armid_ros.motion import FloatArray, Motion, Temperatures
import numpy as np

#: Reference temperature unless another one is given [degC].
_REFERENCE_TEMPERATURE = 25.0


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
        """Return the torque per unit of viscous coefficient: dq [rad/s], shape (N, n, P)."""
        return joint_columns(self, motion, motion.dq)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with the friction as a damping matrix."""
        (viscous,) = scatter(self, values, arm.robot)
        return Action(damping=np.diag(viscous))


@dataclass(frozen=True)
class CoulombFriction(Effect):
    """
    Friction torque that depends on the direction of motion only, tau = Fc sign(dq).

    At rest, the torque takes any value up to Fc. Confounded with a torque offset when a joint
    moves in one direction only.
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994.

    """

    name = 'coulomb_friction'
    summary = 'constant torque against the direction of motion; holds at rest'
    quantities = (Quantity('coulomb_torque', 'N m', lower=0.0, typical=(0.005, 10.0)),)
    holds_at_rest = True

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of Coulomb torque: sign(dq) [-], shape (N, n, P)."""
        return joint_columns(self, motion, direction(motion))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with dry friction between the levels -Fc and Fc."""
        (coulomb,) = scatter(self, values, arm.robot)
        return Action(dry_friction=DryFriction(np.eye(len(coulomb)), -coulomb, coulomb))


@dataclass(frozen=True)
class AsymmetricFriction(JointLaw):
    """
    Difference of Coulomb and viscous friction between the two directions of motion.

    tau = dFc |sign(dq)| + dFv |dq|, where dFc = (Fc+ - Fc-) / 2 and dFv = (Fv+ - Fv-) / 2. The
    joint has Fc+, Fv+ forwards and Fc-, Fv- backwards. The means belong to coulomb_friction and
    viscous_friction. While the joint moves, dFc is exactly collinear with a torque offset.

    """

    name = 'asymmetric_friction'
    summary = 'friction that differs between the two directions of motion'
    quantities = (
        Quantity('coulomb_asymmetry', 'N m', typical=(0.005, 2.0)),
        Quantity('viscous_asymmetry', 'N m s/rad', typical=(0.002, 5.0)),
    )
    holds_at_rest = True

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether the total friction opposes motion in both directions."""
        friction = arm.action().dry_friction
        if friction is None:
            return True
        known = friction.largest(np.zeros(arm.robot.n_joints))
        shift, doubt = (np.abs(scatter(self, each, arm.robot)[0]) for each in (values, std))
        return bool(np.all(shift <= known + MIN_Z_SCORE * doubt))

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the torque per unit of Coulomb and viscous asymmetry: |sign(dq)| and |dq|."""
        return x.forwards**2, x.forwards * x.dq


@dataclass(frozen=True)
class QuadraticFriction(JointLaw):
    """
    Friction torque that grows with the square of the joint velocity, tau = Fq dq |dq|.

    A positive Fq is drag of air or oil. A negative Fq, together with viscous friction, describes
    friction of grease in strain-wave gears, which flattens at high speed. Confounded with
    stribeck_friction, whose curvature lies at low speed, and with saturation of the drive; a wider
    range of speeds distinguishes them.
    Source: Armstrong-Helouvry, Dupont and Canudas de Wit 1994, section 3.

    """

    name = 'quadratic_friction'
    summary = 'friction that grows with the square of the velocity, or flattens'
    quantities = (Quantity('quadratic_coefficient', 'N m s^2/rad^2', typical=(0.0004, 1.0)),)

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the torque per unit of quadratic coefficient: dq |dq| [rad^2/s^2]."""
        return (x.dq * np.abs(x.dq),)


@dataclass(frozen=True)
class StribeckFriction(JointLaw):
    """
    Stribeck friction, which adds to Coulomb friction at low velocity and vanishes at high speed.

    tau = dFs exp(-|dq / vs|^d) sign(dq), where dFs = Fs - Fc is the breakaway torque beyond the
    Coulomb torque. The additional friction is below 3 vs. Confounded with presliding_hysteresis,
    with the curvature of quadratic_friction, and with a velocity that was filtered too much at
    reversals. Constant velocities from 0.01 to 2 rad/s in both directions distinguish them.
    Source: Bo and Pavelescu 1982; Armstrong-Helouvry, Dupont and Canudas de Wit 1994.

    """

    name = 'stribeck_friction'
    summary = 'breakaway torque beyond Coulomb friction, which vanishes at higher velocity'
    quantities = (Quantity('stribeck_torque', 'N m', lower=0.0, typical=(0.001, 10.0)),)
    shapes = (
        Shape('stribeck_velocity', 'rad/s', 1e-4, 20.0, 0.1, (0.01, 0.03, 0.1, 0.3, 1.0)),
        Shape('stribeck_exponent', '', 0.3, 4.0, 2.0, (1.0, 2.0)),
    )
    holds_at_rest = True

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the torque per unit of Stribeck torque: exp(-|dq / vs|^d) sign(dq) [-]."""
        velocity, exponent = self.shape_values.T
        return (np.exp(-(np.abs(x.dq / velocity) ** exponent)) * x.forwards,)


@dataclass(frozen=True)
class ThermalFriction(JointLaw):
    """
    Viscous friction that changes while the joint warms up, with one time constant.

    tau = dFv (1 - exp(-t / T)) dq, t from the beginning of the recording. dFv is negative if the
    grease gets thinner, by 20 to 60 % of the cold coefficient. The effect makes two equal periods
    different, unlike effects that depend on velocity only. torque_drift does the same, but does
    not depend on velocity.
    Source: Bittencourt, Wernholt, Sander-Tavallaey and Brogardh 2010.

    """

    name = 'thermal_friction'
    summary = 'viscous friction that changes while the joint warms up'
    quantities: ClassVar[tuple[Quantity, ...]] = (
        Quantity('viscous_change', 'N m s/rad', typical=(0.001, 6.0)),
    )
    shapes = (Shape('warm_up_time', 's', 0.1, 1e5, 600.0, (10.0, 60.0, 300.0, 1000.0, 3000.0)),)

    @classmethod
    def as_change(cls) -> type[Effect]:
        """Return the effect class that models a change of viscous friction since the baseline."""
        return ThermalChange

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the torque per unit of viscous change: (1 - exp(-t / T)) dq [rad/s]."""
        return (-np.expm1(-x.t / self.shape_values[:, 0]) * x.dq,)


@dataclass(frozen=True)
class ThermalChange(ThermalFriction):
    """
    Change of viscous friction since the baseline: in the cold joint, and during warm-up.

    tau = (c + dFv (1 - exp(-t / T))) dq. A joint that starts colder has more friction at first,
    and the same friction when warm. Reported as thermal_friction and viscous_friction.

    """

    quantities = (*ThermalFriction.quantities, *ViscousFriction.quantities)

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the torque per unit of viscous change and of viscous coefficient [rad/s]."""
        return *super().law(x), x.dq

    def named_as(self, values: FloatArray, arm: Arm) -> tuple[tuple[Effect, FloatArray], ...]:
        """Return the equivalent thermal_friction and viscous_friction, each with its values."""
        change, first = values.reshape(-1, 2).T
        return (
            (ThermalFriction(self.joints, self.shape), change),
            (ViscousFriction(self.joints), first),
        )


@dataclass(frozen=True)
class TemperatureDependentFriction(Effect):
    """
    Friction that changes with the measured temperature, tau = (T - T0) (a dq + b sign(dq)).

    The viscous and the Coulomb coefficient of the model are those at the reference temperature T0.
    Grease gets thinner with temperature, Fv exp(-k (T - T0)) with k from 0.01 to 0.03 1/K. The
    slope a is the first-order term, -k Fv. Without measured temperature, the joints are at
    T0. Unlike thermal_friction, the effect is the same on a cold and on a warm day.
    Source: Bittencourt and Axelsson 2014, in the form of first order.

    Attributes
    ----------
    reference : tuple of (str, float)
        Joints and their T0 [degC]; 25 degC for other joints.
    course : Temperatures or None
        Measured temperatures; see `along`.

    """

    reference: tuple[tuple[str, float], ...] = ()
    course: Temperatures | None = field(default=None, compare=False, repr=False)

    name = 'temperature_dependent_friction'
    summary = 'friction that changes with the measured temperature of a joint'
    quantities = (
        Quantity('viscous_slope', 'N m s/(rad K)', typical=(0.00004, 0.3)),
        Quantity('coulomb_slope', 'N m/K', typical=(0.00005, 0.3)),
    )
    holds_at_rest = True
    lasting = True

    def __post_init__(self) -> None:
        """Set missing reference temperatures of joints to 25 degC."""
        super().__post_init__()
        known = dict.fromkeys(self.joints, _REFERENCE_TEMPERATURE) | dict(self.reference)
        object.__setattr__(self, 'reference', tuple(known.items()))

    def along(self, motion: Motion) -> Self:
        """Return a copy of the effect with the joint temperatures measured during a motion."""
        return replace(self, course=motion.temperature) if motion.temperature else self

    def referred_to(self, temperatures: Mapping[str, float]) -> Self:
        """Return a copy with the given reference temperatures [degC], by joint name."""
        return replace(self, reference=tuple(temperatures.items()))

    def particulars(self) -> dict[str, Any]:
        """Return the reference temperature of each joint as an entry for model.yaml."""
        return {'reference_temperature': self.reference_temperatures}

    def with_particulars(self, entry: Mapping[str, Any]) -> Self:
        """Return a copy with the reference temperatures from an entry of model.yaml."""
        known = entry.get('reference_temperature', {})
        return self.referred_to({joint: finite(t, f'{joint}: T0') for joint, t in known.items()})

    @property
    def reference_temperatures(self) -> dict[str, float]:
        """Reference temperature of each joint [degC]."""
        known = dict(self.reference)
        return {joint: known[joint] for joint in self.joints}

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether friction changes by at most 5 %/K, and viscous friction does not rise."""
        action, n = arm.action(), arm.robot.n_joints
        known = np.zeros((2, n))
        if action.damping is not None:
            known[0] = np.diag(action.damping)
        if action.dry_friction is not None:
            known[1] = action.dry_friction.largest(np.zeros(n))
        known = np.where(known > 0.0, known, np.inf)
        slopes, doubts = (scatter(self, each, arm.robot) for each in (values, MIN_Z_SCORE * std))
        # friction with grease changes by 0.01 to 0.03 of its size per kelvin
        steep = np.abs(slopes) > 0.05 * known + doubts
        return not (steep.any() or np.any(slopes[0] > doubts[0]))

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of viscous and Coulomb slope, (N, n, P) [K rad/s and K]."""
        warmer = self.along(motion).warmer(motion.t, motion.joints)
        return joint_columns(self, motion, warmer * motion.dq, warmer * direction(motion))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with dry friction, and with a torque function of time and velocity."""
        viscous, coulomb = scatter(self, values, arm.robot)
        if self.course is None:
            return Action()
        change = self.warmer(self.course.t, arm.robot.joints) * coulomb
        level = change.max(axis=0)  # a joint holds at rest up to the largest friction

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            warmer = self.warmer(t, arm.robot.joints).reshape(*np.shape(t), -1)
            return np.asarray(warmer * viscous * dq + (warmer * coulomb - level) * np.sign(dq))

        return Action(dry_friction=DryFriction(np.eye(len(level)), -level, level), torque=torque)

    def warmer(self, t: FloatArray, joints: tuple[str, ...]) -> FloatArray:
        """Return joint temperatures minus T0 at times t, zero if not measured, (N, n) [K]."""
        if self.course is None:
            return np.zeros((np.size(t), len(joints)))
        known = dict(self.reference)
        reference = [known.get(joint, _REFERENCE_TEMPERATURE) for joint in joints]
        return np.nan_to_num(self.course.at(t) - reference)
