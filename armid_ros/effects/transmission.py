# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Elasticity and backlash of transmissions between motor and link.

Positions are measured at the motors; the load displaces the links. The torque that twists a
transmission is the torque of the rigid body along the recorded motion, which is a first-order
approximation. Friction and rotor inertia act on the motor side.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.effects.action import Action, Displacement, Transmission
from armid_ros.effects.base import Arm
from armid_ros.effects.joint_law import joint_columns, scatter
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.effects.readings import Displacing
from armid_ros.effects.timing import low_pass, rate_of_change, within_band
from armid_ros.motion import FloatArray, Motion
import numpy as np
from scipy.integrate import cumulative_trapezoid


@dataclass(frozen=True)
class JointElasticity(Displacing):
    """
    Elastic transmission, q_link = q_motor - tau / K, with K = 1 / compliance.

    To first order, the torque changes by -(dtau/dq tau + dtau/ddq dtau/dt + M d^2tau/dt^2) / K,
    summed over the elastic joints. With a damper D parallel to the spring, the twist follows the
    torque with the retardation time D / K. Confounded with time_delay and torque_lag at low
    frequency, and with an elastic base. A sweep through antiresonance and resonance, or an encoder
    at the link, distinguishes them.
    Source: Spong 1987.

    """

    name = 'joint_elasticity'
    summary = 'elastic transmission between motor and link'
    quantities = (Quantity('compliance', 'rad/(N m)', lower=0.0, typical=(2e-5, 1e-2)),)
    shapes = (Shape('retardation_time', 's', 0.0, 1.0, 0.0, (0.0, 0.001, 0.003, 0.01)),)
    linear = False
    instantaneous = False

    def displacements(self, motion: Motion, arm: Arm) -> Displacement:
        """Return the link displacement per unit of compliance: minus the spring torque."""
        load = within_band(motion, arm.load(motion))
        (retardation,) = scatter(self, self.shape_values, arm.robot)
        for joint in np.flatnonzero(retardation):
            load[:, joint] = low_pass(motion.t, load[:, joint], float(retardation[joint]))
        return _twist(self, motion, load)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with springs and dampers for the plant, and link displacements."""
        if not np.any(values):
            return Action()
        (compliance,) = scatter(self, values, arm.robot)
        (retardation,) = scatter(self, self.shape_values, arm.robot)
        elastic, rigid = compliance > 0.0, np.full_like(compliance, np.inf)
        stiffness = np.divide(1.0, compliance, out=rigid, where=elastic)
        none = np.zeros_like(compliance)
        damping = np.divide(retardation, compliance, out=none.copy(), where=elastic)
        springs = Transmission(stiffness, damping, none)
        return replace(super().action(values, arm), transmission=springs)


@dataclass(frozen=True)
class Backlash(Displacing):
    """
    Free play of a gear, q_link = q_motor - b / 2 on the loaded flank.

    When the load changes its sign, the link leaves its flank and crosses to the other flank. Its
    acceleration relative to the motor is load / M_jj, and it lands without a bounce. The torque is
    linear in the quantity ``backlash``. The shape ``crossing_width`` determines the duration of a
    crossing. Both are equal for a real gap. Confounded with presliding_hysteresis and with a
    hardening spring. Reversals with and without load, or an encoder at the link, distinguish them.
    Source: Nordin and Gutman 2002.

    """

    name = 'backlash'
    summary = 'free play of a gear'
    quantities = (Quantity('backlash', 'rad', lower=0.0, typical=(1e-4, 0.02)),)
    shapes = (Shape('crossing_width', 'rad', 1e-6, 1.0, 1e-3, tuple(1e-4 * 1.6 ** np.arange(12))),)
    linear = False
    instantaneous = False

    def displacements(self, motion: Motion, arm: Arm) -> Displacement:
        """Return the link displacement per unit of backlash, -1/2 to 1/2: minus twist over gap."""
        load = arm.load(motion)
        inertia = np.diagonal(arm.load_derivatives(motion)[2], axis1=1, axis2=2)
        place = np.zeros(motion.q.shape)
        for joint, (width,) in zip(self.indices(motion.joints), self.shape_values, strict=True):
            # lower limit of the inertia, for a link without inertia [kg m^2]
            pull = load[:, joint] / np.maximum(inertia[:, joint], 1e-9)
            place[:, joint] = place_in_gap(motion.t, pull, float(width)) / width
        return _twist(self, motion, place)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with free play for the plant, and link displacements."""
        if not np.any(values):
            return Action()
        (gap,) = scatter(self, values, arm.robot)
        rigid = np.full_like(gap, np.inf)
        gaps = Transmission(rigid, np.zeros_like(gap), gap / 2)
        return replace(super().action(values, arm), transmission=gaps)


def place_in_gap(t: FloatArray, pull: FloatArray, width: float) -> FloatArray:
    """Return the positions (N,) of a body that the acceleration `pull` moves between two stops."""
    speed = cumulative_trapezoid(pull, t, initial=0.0)
    way = cumulative_trapezoid(speed, t, initial=0.0)
    times, speeds, ways = t.tolist(), speed.tolist(), way.tolist()
    count, half = len(t), 0.5 * width
    backwards, forwards = (np.append(np.flatnonzero(p < 0.0), count) for p in (pull, -pull))
    place, start = np.empty(count), 0
    side = half if pull[0] >= 0.0 else -half
    while start < count:
        away = backwards if side > 0.0 else forwards
        leave = int(away[np.searchsorted(away, start)])
        place[start:leave] = side
        for start in range(leave, count):
            flown = ways[start] - ways[leave] - speeds[leave] * (times[start] - times[leave])
            if abs(side + flown) > half:
                side = half if side + flown > 0.0 else -half
                break
            place[start] = side + flown
        else:
            break
    return place


def _twist(effect: Displacing, motion: Motion, twist: FloatArray) -> Displacement:
    """Return the link displacements that given twists cause, per unit of each parameter."""
    speed = rate_of_change(motion.t, twist)
    parts = (-twist, -speed, -rate_of_change(motion.t, speed))
    return Displacement(*(joint_columns(effect, motion, part) for part in parts))
