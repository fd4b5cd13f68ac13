# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Transmissions that give way between motor and link: elasticity and backlash.

Positions are read at the motors, and the links are where the load has pushed them. The torque that
twists a transmission is the rigid body's along the recorded motion, which is the first order of
what the links do. Everything that is not the rigid body or attached to the links (friction, rotor
inertia) acts on the side of the motors.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from armid_ros.effects.action import Action, Displacement, Transmission
from armid_ros.effects.base import Quantity, Shape
from armid_ros.effects.layout import joint_columns, scatter
from armid_ros.effects.readings import Displacing
from armid_ros.effects.timing import low_pass, rate_of_change
from armid_ros.motion import FloatArray, Motion
import numpy as np

if TYPE_CHECKING:
    from armid_ros.arm import ArmModel


@dataclass(frozen=True)
class JointElasticity(Displacing):
    """
    Elastic transmission, q_link = q_motor - tau / K, with K = 1 / compliance.

    The first order of the torque is
    -(dtau/dq tau + dtau/ddq dtau/dt + M d^2tau/dt^2) / K, summed over the joints that
    give way. A damper D beside the spring makes the twist follow the torque with the retardation
    time D / K. Confounded with time_delay and torque_lag at low frequency, with a base that
    gives way; a sweep through antiresonance and resonance, or an encoder at the link, tells.
    Source: Spong 1987.

    """

    name = 'joint_elasticity'
    summary = 'elastic transmission between motor and link'
    quantities = (Quantity('compliance', 'rad/(N m)', lower=0.0, typical=(2e-5, 1e-2)),)
    shapes = (Shape('retardation_time', 's', 0.0, 1.0, 0.0, (0.0, 0.001, 0.003, 0.01)),)
    linear = False
    instantaneous = False

    def displacements(self, motion: Motion, arm: ArmModel) -> Displacement:
        """Return minus the torque that twists the transmission, and its derivatives."""
        load = arm.load(motion)
        (retardation,) = self.shape_over_joints(arm.robot)
        for joint in np.flatnonzero(retardation):
            load[:, joint] = low_pass(motion.t, load[:, joint], float(retardation[joint]))
        return _twist(self, motion, load)

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return springs and dampers, and what encoders at the motors make of them."""
        (compliance,) = scatter(self, values, arm.robot)
        (retardation,) = self.shape_over_joints(arm.robot)
        with np.errstate(divide='ignore'):
            stiffness = np.where(compliance > 0.0, 1.0 / compliance, np.inf)
        damping = np.where(compliance > 0.0, retardation, 0.0) * np.where(
            compliance > 0.0, stiffness, 0.0
        )
        springs = Transmission(stiffness, damping, np.zeros_like(stiffness))
        if not np.any(values):
            return Action()
        return replace(super().action(values, arm), transmission=springs)


@dataclass(frozen=True)
class Backlash(Displacing):
    """
    Free play of a gear, q_link = q_motor - b / 2 on the flank that carries the load.

    The load changes flanks as tanh(tau / tau_m), within a meshing torque tau_m that stands for
    friction and film between the teeth. Confounded with presliding_hysteresis and with a spring
    that hardens; reversals with and without load, or an encoder at the link, tell.

    """

    name = 'backlash'
    summary = 'free play of a gear'
    quantities = (Quantity('backlash', 'rad', lower=0.0, typical=(1e-4, 0.02)),)
    shapes = (Shape('meshing_torque', 'N m', 1e-6, 1e4, 0.1, (0.01, 0.03, 0.1, 0.3, 1.0)),)
    linear = False
    instantaneous = False

    def displacements(self, motion: Motion, arm: ArmModel) -> Displacement:
        """Return minus half the side of the gap that the load lies on, and its derivatives."""
        (meshing,) = self.shape_over_joints(arm.robot)
        return _twist(self, motion, 0.5 * np.tanh(arm.load(motion) / meshing))

    def action(self, values: FloatArray, arm: ArmModel) -> Action:
        """Return the gaps, and what encoders at the motors make of them."""
        (gap,) = scatter(self, values, arm.robot)
        if not np.any(values):
            return Action()
        rigid = np.full_like(gap, np.inf)
        gaps = Transmission(rigid, np.zeros_like(gap), gap / 2)
        return replace(super().action(values, arm), transmission=gaps)


def _twist(effect: Displacing, motion: Motion, twist: FloatArray) -> Displacement:
    """Place twists of the motors against the links, (N, n), in columns, with derivatives."""
    speed = rate_of_change(motion.t, twist)
    parts = (-twist, -speed, -rate_of_change(motion.t, speed))
    return Displacement(*(joint_columns(effect, motion, part) for part in parts))
