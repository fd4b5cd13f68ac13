# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Effects of the drives: rotor inertia, torque ripple and saturation."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.effects.action import Action
from armid_ros.effects.base import Arm, Effect, Unexplained
from armid_ros.effects.joint_law import joint_columns, JointLaw, JointStates, scatter
from armid_ros.effects.quantities import Quantity, Shape
from armid_ros.effects.readings import TorqueReading
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class RotorInertia(Effect):
    """
    Inertia of rotor and gear, reflected to the joint, tau = Ia ddq.

    Ia is the rotor's inertia times the gear ratio squared; gyroscopic coupling is neglected, as is
    usual for geared arms. For the first joint, it is exactly collinear with Izz of the link.
    Source: Khalil and Dombre 2002, section 9.4.

    """

    name = 'rotor_inertia'
    summary = 'inertia of rotor and gear, reflected to the joint'
    quantities = (Quantity('rotor_inertia', 'kg m^2', lower=0.0, typical=(0.001, 1.1)),)

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque per unit of rotor inertia: ddq [rad/s^2], shape (N, n, P)."""
        return joint_columns(self, motion, motion.ddq)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action that adds the rotor inertias to the inertia matrix of the plant."""
        (inertia,) = scatter(self, values, arm.robot)
        return Action(inertia=np.diag(inertia))


#: Lowest order of a ripple [1/rev]; gravity has lower orders.
_MIN_RIPPLE_ORDER = 1.5


@dataclass(frozen=True)
class TorqueRipple(JointLaw):
    """
    Torque that is periodic in the joint position, tau = A sin(n q) + B cos(n q).

    Cogging of a motor with N_c cycles per turn behind a gear of ratio N has n = N N_c per turn of
    the joint. The kinematic error of a strain-wave gear has n = 2 N. The order does not depend on
    the speed: search for it before filters of fixed frequency remove it. Confounded with
    joint_spring and gravity at orders of 1 and below, which are not searched.
    Source: Taghirad and Belanger 1998.

    """

    name = 'torque_ripple'
    summary = 'torque that is periodic in the joint position: cogging, gear error'
    quantities = (
        Quantity('ripple_sine', 'N m', typical=(0.002, 2.0)),
        Quantity('ripple_cosine', 'N m', typical=(0.002, 2.0)),
    )
    shapes = (
        Shape(
            'ripple_order',
            '1/rev',
            _MIN_RIPPLE_ORDER,
            1e5,
            20.0,
            (4.0, 6.0, 8.0, 12.0, 20.0, 50.0, 100.0),
        ),
    )

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """Return start values: the ripple orders that best explain each joint's residual."""
        robot = arm.robot
        # Range of ripple orders in a search [1/rad, 1/m]. Gravity and springs cause lower orders;
        # filters remove higher orders. Screws and racks have a turn or tooth every 4 to 60 mm.
        orders = [
            _wave_orders(
                unexplained, joint, (100.0, 1600.0) if robot.prismatic[joint] else (3.0, 80.0)
            )
            for joint in self.indices(robot.joints)
        ]
        return (np.array(orders),)

    def plausible(self, values: FloatArray, std: FloatArray, arm: Arm) -> bool:
        """Return whether the ripple order exceeds the orders of gravity and spring torques."""
        return bool(np.all(self.shape_values > 1.05 * _MIN_RIPPLE_ORDER))

    def law(self, x: JointStates) -> tuple[FloatArray, ...]:
        """Return the torque per unit of sine and cosine amplitude: sin(n q) and cos(n q) [-]."""
        angle = self.shape_values[:, 0] * x.q
        return np.sin(angle), np.cos(angle)


def _wave_orders(unexplained: Unexplained, joint: int, between: tuple[float, float]) -> FloatArray:
    """Return the ripple orders in a range [1/rad or 1/m] that best explain a joint's residual."""
    # all recordings are used together, because a ripple has the same order and phase in each
    count = 3  # of returned orders
    weight = unexplained.weight[:, joint]
    rows = weight > 0.0
    if not rows.any():
        return np.full(count, between[0])
    angle, scale = unexplained.q[rows, joint], weight[rows]
    rest = unexplained.residual[rows, joint] * scale
    step = 0.5 * np.pi / max(float(np.ptp(angle)), 0.3 / between[0])
    orders = np.arange(*between, step)
    gain = _wave_gains(angle, rest, scale, orders)
    padded = np.concatenate([[0.0], gain, [0.0]])
    peaks = np.flatnonzero((gain >= padded[:-2]) & (gain > padded[2:]))
    likely = orders[peaks[np.argsort(-gain[peaks])[:12]]]
    likely = likely if len(likely) else orders[:1]
    fine = likely[:, np.newaxis] + step * np.linspace(-1.0, 1.0, 2 * 8 + 1)
    gain = _wave_gains(angle, rest, scale, fine.ravel()).reshape(fine.shape)
    best = np.argsort(-gain.max(axis=1))[:count]
    return np.resize(fine[best, np.argmax(gain[best], axis=1)], count)


def _wave_gains(
    angle: FloatArray, residual: FloatArray, weight: FloatArray, orders: FloatArray
) -> FloatArray:
    """Return the decrease of the squared residual by a sine and cosine of each order, (K,)."""
    # with few cycles, orders leak into each other; least squares separate them better than a
    # spectrum
    wave = np.exp(1j * np.outer(orders, angle))
    aim, twice, count = wave @ (weight * residual), wave**2 @ weight**2, np.sum(weight**2)
    cosines, sines, mixed = count + twice.real, count - twice.real, twice.imag
    determinant = np.maximum(cosines * sines - mixed**2, 1e-6 * count**2)
    squares = sines * aim.real**2 - 2.0 * mixed * aim.real * aim.imag + cosines * aim.imag**2
    return np.asarray(2.0 * squares / determinant)


@dataclass(frozen=True)
class ActuatorSaturation(TorqueReading):
    """
    Drive saturation: torque beyond a level is partly not supplied, or partly not reported.

    With the excess over the level L, e(x) = sign(x) max(|x| - L, 0):

        reading = tau + lost e(reported) - clipped e(tau),

    where the drive reports the commanded torque and supplies tau = reported - lost e(reported). A
    value of lost = 1 is a hard torque limit; a smaller value is a motor constant that decreases at
    high current. A value of clipped = 1 is a report that is limited to L. The column of ``lost``
    is computed from the measured torque, if it was recorded. The torque is linear in the column,
    which explains only torque beyond L. Confounded with quadratic_friction where high torque means
    high speed, and with torque_gain if L is low. A sweep of amplitudes distinguishes them.

    """

    name = 'actuator_saturation'
    summary = 'torque beyond a level that the drive does not fully supply or report'
    quantities = (
        Quantity('lost_share', '', lower=0.0, upper=1.0, typical=(0.05, 1.0)),
        Quantity('clipped_share', '', lower=0.0, upper=1.0, typical=(0.05, 1.0)),
    )
    #: Start values near the highest measured torque; lower ones would explain all torque.
    shapes = (
        Shape('saturation_torque', 'N m', 1e-6, 1e6, 10.0, (0.3, 1.0, 3.0, 10.0, 30.0), near=0.08),
    )

    def _default_shape(self, robot: Robot) -> FloatArray:
        limits = robot.torque_limit[self.indices(robot.joints)][:, np.newaxis]
        known = np.isfinite(limits) & (limits > 0.0)
        return np.where(known, 0.8 * limits, self.shape_values)

    def shape_starts(self, unexplained: Unexplained, arm: Arm) -> tuple[FloatArray, ...]:
        """Return start values of the level: 30 to 95 % of the highest torque of each joint."""
        motion = unexplained.motion
        tau = arm.joint_torque(motion) if motion.tau is None else motion.tau
        highest = np.maximum(np.max(np.abs(tau[:, self.indices(motion.joints)]), axis=0), 1e-3)
        return (np.outer(highest, [0.3, 0.4, *np.linspace(0.5, 0.95, 10)]),)

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action that saturates the supplied torque and the reported torque."""
        lost = scatter(self, values, arm.robot)[0]
        (level,) = scatter(self, self.shape_values, arm.robot)

        def drive(tau: FloatArray) -> FloatArray:
            return np.asarray(tau - lost * _excess(tau, level))

        reading = super().action(values, arm)
        return Action(drive=drive if np.any(lost) else None, reading=reading.reading)

    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the torque that saturated drives report, shape (N, n) [N m]."""
        lost, clipped, level = self._spread(values, motion)
        hidden = clipped * _excess(tau, level)
        if motion.tau is None:
            return np.asarray(tau + lost / (1.0 - lost) * _excess(tau, level) - hidden)
        return np.asarray(tau + lost * _excess(motion.tau, level) - hidden)

    def transfer(
        self, values: FloatArray, motion: Motion, tau: FloatArray, columns: FloatArray
    ) -> FloatArray:
        """Convert a regressor of true torques to a regressor of reported torques, (N, n, Q)."""
        lost, clipped, level = self._spread(values, motion)
        slope = (lost / (1.0 - lost) if motion.tau is None else 0.0) - clipped
        return np.asarray((1.0 + slope * (np.abs(tau) > level))[:, :, np.newaxis] * columns)

    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return derivatives of the reported torque by lost and clipped share, (N, n, P) [N m]."""
        lost, _, level = self._spread(values, motion)
        beyond = _excess(tau, level)
        asked = beyond / (1.0 - lost) ** 2 if motion.tau is None else _excess(motion.tau, level)
        return joint_columns(self, motion, asked, -beyond)

    def _spread(self, values: FloatArray, motion: Motion) -> tuple[FloatArray, ...]:
        """Return lost share, clipped share and saturation level [N m] of all joints, (n,) each."""
        spread = np.zeros((3, motion.n_joints))
        spread[2] = np.inf
        columns = self.indices(motion.joints)
        spread[:2, columns] = values.reshape(-1, 2).T
        spread[2, columns] = self.shape_values[:, 0]
        if motion.tau is None:
            # Largest lost share of the excess. Without the commanded torque, a share of 1 cannot
            # be represented, because no torque beyond the level is measured.
            spread[0] = np.minimum(spread[0], 0.99)
        return spread[0], spread[1], spread[2]


def _excess(tau: FloatArray, level: FloatArray) -> FloatArray:
    return np.asarray(np.sign(tau) * np.maximum(np.abs(tau) - level, 0.0))
