# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction that depends on the load, or on the travel since the last reversal."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.effects.action import Action, direction, DryFriction
from armid_ros.effects.base import Arm, Effect
from armid_ros.effects.joint_law import joint_columns, scatter
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.effects.slipping import Hysteresis
from armid_ros.motion import FloatArray, Motion
import numpy as np


@dataclass(frozen=True)
class LoadDependentFriction(Effect):
    """
    Dry friction proportional to the load on the gear, tau = Kl |tau_load| sign(dq).

    tau_load is the torque of the rigid body. At rest, the joint can stick. Confounded with
    torque_gain while the joint lifts its load; the same motion with two known payloads
    distinguishes them.
    Source: Bittencourt and Gunnarsson 2012; Duclusaud et al. 2024 (BAM), model M2.

    """

    name = 'load_dependent_friction'
    summary = 'dry friction in proportion to the torque that the gear transmits'
    quantities = (Quantity('load_coefficient', '', lower=0.0, upper=1.0, typical=(0.01, 0.4)),)
    holds_at_rest = True

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of load coefficient: |tau_load| sign(dq), (N, n, P) [N m]."""
        load = arm.load(arm.link_motion(motion))
        return joint_columns(self, motion, np.abs(load) * direction(motion))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with dry friction whose levels rise with the load."""
        (share,) = scatter(self, values, arm.robot)
        zero = np.zeros_like(share)
        return Action(dry_friction=DryFriction(np.eye(len(share)), zero, zero, share))


@dataclass(frozen=True)
class PreslidingHysteresis(Effect):
    """
    Friction that builds up over a short distance after each reversal of the joint.

    tau = F h, dh = (1 - h sign(dq)) |dq| / s: asperities of the surfaces bend before they slip.
    The torque depends on the travel since the last reversal, not on velocity. The hysteresis
    loops are the same at any rate, and even slow motion dissipates energy. Far from reversals it
    equals coulomb_friction. If a model contains both, F is the part that builds up gradually.
    Confounded with stribeck_friction, backlash and a velocity that was filtered too much;
    triangles of less than 0.02 rad at two rates distinguish them.
    Source: Dahl 1968.

    """

    name = 'presliding_hysteresis'
    summary = 'friction that builds up over a short distance after each reversal'
    quantities = (Quantity('presliding_torque', 'N m', lower=0.0, typical=(0.005, 10.0)),)
    shapes = (
        Shape('breakaway_distance', 'rad', 1e-6, 1.0, 0.01, (0.001, 0.003, 0.01, 0.03, 0.1)),
    )
    instantaneous = False

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of presliding torque: spring states, -1 to 1, (N, n, P)."""
        columns = np.zeros((*motion.q.shape, len(self.joints)))
        states = self._elements(np.ones(len(self.joints)), motion.joints).along(
            motion.q, motion.dq
        )
        for position, joint in enumerate(self.indices(motion.joints)):
            columns[:, joint, position] = states[:, position]
        return columns

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with slipping springs, which are the friction of the plant."""
        if not np.any(values):
            return Action()
        return Action(hysteresis=self._elements(values, arm.robot.joints))

    def _elements(self, level: FloatArray, joints: tuple[str, ...]) -> Hysteresis:
        """Return slipping springs on the joints of the effect, with given torque levels [N m]."""
        directions = np.eye(len(joints))[self.indices(joints)]
        return Hysteresis(directions, level, self.shape_values[:, 0])
