# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Errors of torque and position readings."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.effects.action import Action, Displacement
from armid_ros.effects.base import Arm, Effect, Unexplained
from armid_ros.effects.joint_law import joint_columns, scatter
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.effects.readings import Displacing, TorqueReading
from armid_ros.motion import FloatArray, Motion
import numpy as np


@dataclass(frozen=True)
class TorqueOffset(Effect):
    """
    Constant torque, added in motion and at rest, tau = offset.

    Confounded with asymmetric Coulomb friction while the joint moves and with the preload of a
    spring.
    Source: Gautier, Janot and Vandanjon 2013.

    """

    name = 'torque_offset'
    summary = 'constant torque, in motion and at rest'
    quantities = (Quantity('torque_offset', 'N m', typical=(0.004, 2.0)),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of offset, which is 1, shape (N, n, P)."""
        return joint_columns(self, motion, np.ones_like(motion.q))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action with the offset as a constant torque."""
        (offset,) = scatter(self, values, arm.robot)

        def torque(t: FloatArray, q: FloatArray, dq: FloatArray) -> FloatArray:
            return offset if np.shape(dq) == offset.shape else np.broadcast_to(offset, dq.shape)

        return Action(torque=torque)


@dataclass(frozen=True)
class TorqueGain(TorqueReading):
    """
    Torque readings with a relative error, reading = (1 + epsilon) tau.

    The cause is a wrong motor constant or sensor scale. The same share in all joints is exactly
    collinear with a scaling of all masses, inertias and friction; one known payload distinguishes
    them.

    """

    name = 'torque_gain'
    summary = 'relative error of the torque readings'
    quantities = (Quantity('gain_error', '', lower=-0.95, typical=(0.005, 0.3)),)

    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Apply the gain error to torques [N m] or regressor columns, shape (N, n, ...)."""
        gain = np.ones(motion.n_joints)
        gain[self.indices(motion.joints)] += values
        return np.asarray(tau * gain.reshape(-1, *(1,) * (tau.ndim - 2)))

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the derivative of the reading by the gain error: the true torque, (N, n, P)."""
        return joint_columns(self, motion, tau)


@dataclass(frozen=True)
class TorqueDrift(TorqueReading):
    """
    Drift of torque readings while sensor or electronics warm up, with one time constant.

    The drift is d (1 - exp(-t / T)), t from the beginning of the recording. It does not depend on
    the motion, unlike thermal_friction, and makes equal periods differ. Confounded with
    torque_offset if the sensor starts warm and, in one short recording, with a slipping payload.

    """

    name = 'torque_drift'
    summary = 'torque readings that drift with time, independent of the motion'
    quantities = (Quantity('drift', 'N m', typical=(0.01, 5.0)),)
    shapes = (Shape('drift_time', 's', 0.1, 1e5, 600.0, (10.0, 60.0, 300.0, 1000.0, 3000.0)),)

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """Return start values of the time constant: 0.3, 1 and 3 times the recorded time span."""
        # a faster drift is an offset, and a slower drift is a straight line
        times = np.maximum(
            float(np.ptp(unexplained.motion.t)) * np.array((0.3, 1.0, 3.0)), self.shapes[0].lower
        )
        return (np.tile(times, (len(self.joints), 1)),)

    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the torque readings with drift, shape (N, n) [N m]."""
        return np.asarray(tau + self.sensitivity(values, motion, tau) @ values)

    def transfer(
        self, values: FloatArray, motion: Motion, tau: FloatArray, columns: FloatArray
    ) -> FloatArray:
        """Return the regressor unchanged, because the drift does not depend on the torque."""
        return columns

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the derivative of the reading by the drift: 1 - exp(-t / T) [-], (N, n, P)."""
        constants = np.ones(motion.n_joints)
        constants[self.indices(motion.joints)] = self.shape_values[:, 0]
        return joint_columns(self, motion, -np.expm1(-motion.t[:, np.newaxis] / constants))


@dataclass(frozen=True)
class EncoderOffset(Displacing):
    """
    Zero error of an encoder, q = reading + offset.

    To first order, the torque changes by dtau/dq times the offset, which is the same at all loads.
    Confounded with base_tilt (exactly, for the first joint of a planar arm), and with the
    direction of the link's first moment. Free rigid parameters of a planar arm absorb the second
    joint's offset exactly. Hard stops, or centres of mass known from drawings, distinguish them.

    """

    name = 'encoder_offset'
    summary = 'wrong zero of a position encoder'
    quantities = (Quantity('encoder_offset', 'rad', typical=(0.001, 0.1)),)
    linear = False

    def displacements(self, motion: Motion, arm: Arm) -> Displacement:
        """Return the displacement per unit of offset: 1 in q, 0 in dq and in ddq."""
        shift = joint_columns(self, motion, np.ones_like(motion.q))
        return Displacement(shift, np.zeros_like(shift), np.zeros_like(shift))
