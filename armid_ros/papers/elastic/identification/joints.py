# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Springs of any arm, joint by joint, from encoders on both sides of its transmissions.

The torque of a spring is that of inverse dynamics along the motion of the links. The twist has one
part from compliance and one from free play. The rest of the motor torque is rotor inertia, viscous
and Coulomb friction. Both models are linear, and slow motion is sufficient. The resonances follow
from inertia and stiffness.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import IdentificationError
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.elastic.identification.interaction import direction
from armid_ros.papers.elastic.identification.transmission import (
    CUTOFF,
    fit_transmission,
    TransmissionFit,
    TwoEncoders,
)
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin
from scipy.signal import butter, sosfiltfilt

#: Shortest stretch without a pause that is used [s].
_SHORTEST = 2.0
#: Least R^2 of the twist for an estimate of stiffness.
_EXPLAINED = 0.9


@dataclass(frozen=True, eq=False)
class SpringEstimate:
    """
    Spring, free play and motor of one joint, from two encoders and a torque.

    Attributes
    ----------
    joint : str
        Its name.
    transmission : TransmissionFit
        Stiffness and free play.
    motor : ndarray, shape (3,), or None
        Rotor inertia [kg m^2], viscous friction [N m s/rad] and Coulomb torque [N m] of the motor
        at the joint; None if no torque was recorded.
    inertia : float
        Link inertia about the joint with the other joints held, mean over the recording [kg m^2].

    """

    joint: str
    transmission: TransmissionFit
    motor: FloatArray | None
    inertia: float

    @property
    def informative(self) -> bool:
        """Whether the twist follows the load, so that the stiffness is identifiable."""
        fit = self.transmission
        return fit.explained > _EXPLAINED and bool(np.isfinite(fit.stiffness).all())

    @property
    def antiresonance(self) -> float:
        """Natural frequency of the link on its spring with the motor held [Hz]."""
        return float(np.sqrt(self.transmission.stiffness[0] / self.inertia) / (2.0 * np.pi))

    @property
    def resonance(self) -> float:
        """Natural frequency of motor against link [Hz]; NaN without a rotor inertia."""
        if self.motor is None or self.motor[0] <= 0.0:
            return float('nan')
        return float(self.antiresonance * np.sqrt(1.0 + self.inertia / self.motor[0]))


def fit_springs(
    robot: Robot,
    sides: Sequence[tuple[Recording, Recording]],
    rng: np.random.Generator,
) -> list[SpringEstimate]:
    """
    Fit a spring, free play and a motor to every joint of an arm.

    Parameters
    ----------
    robot : Robot
        Robot with known inertias and gravity.
    sides : sequence of (Recording, Recording)
        Recordings of motors (at the joints) and of links, with common timestamps.
    rng : numpy.random.Generator
        Random numbers for the bootstrap blocks of the intervals.

    Raises
    ------
    IdentificationError
        If no stretch is long enough, or a joint hardly moves.

    """
    stretches = [piece for pair in sides for piece in _stretches(*pair)]
    if not stretches:
        raise IdentificationError(
            f'springs: there is no stretch of {_SHORTEST:g} s without a pause in the recordings'
        )
    loads = [inverse_dynamics(robot, link) for _, link in stretches]
    q = np.concatenate([link.q for _, link in stretches])
    data = robot.model.createData()
    chosen = q[np.linspace(0, len(q) - 1, 200).astype(int)]
    diagonals = [np.diag(pin.crba(robot.model, data, pose)).copy() for pose in chosen]
    inertia = np.asarray(np.mean(diagonals, axis=0))
    found = []
    for j, joint in enumerate(robot.joints):
        records = [
            TwoEncoders(motor.t[1] - motor.t[0], motor.q[:, j], link.q[:, j], load[:, j], True)
            for (motor, link), load in zip(stretches, loads, strict=True)
        ]
        try:
            fit = fit_transmission(records, rng)
        except IdentificationError as error:
            raise IdentificationError(f"joint '{joint}': {error}") from None
        own = _motor([motor for motor, _ in stretches], loads, j)
        found.append(SpringEstimate(joint, fit, own, float(inertia[j])))
    return found


def _stretches(motors: Recording, links: Recording) -> list[tuple[Motion, Motion]]:
    """Return filtered motions of motors and links without pauses, with the motor torque."""
    period = motors.period
    sections = butter(4, CUTOFF, fs=1.0 / period, output='sos')

    def smooth(at: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
        even = np.column_stack([np.interp(at, times, column) for column in values.T])
        return np.asarray(sosfiltfilt(sections, even, axis=0))

    link_times = links.t + 1e-9 * (links.start_ns - motors.start_ns)
    cuts = np.flatnonzero(np.diff(motors.t) > 5.0 * period) + 1
    pieces = []
    for rows in np.split(np.arange(len(motors)), cuts):
        if len(rows) * period < _SHORTEST:
            continue
        t = np.asarray(period * np.arange(len(rows)), dtype=np.float64)
        at = motors.t[rows[0]] + t
        motor = _motion(motors.joints, t, smooth(at, motors.t, motors.q))
        if motors.tau is not None:
            motor = replace(motor, tau=smooth(at, motors.t, motors.tau))
        pieces.append((motor, _motion(links.joints, t, smooth(at, link_times, links.q))))
    return pieces


def _motion(joints: tuple[str, ...], t: FloatArray, q: FloatArray) -> Motion:
    dq = np.gradient(q, t, axis=0)
    return Motion(joints, t, q, dq, np.gradient(dq, t, axis=0))


def _motor(motors: Sequence[Motion], loads: Sequence[FloatArray], joint: int) -> FloatArray | None:
    """Fit rotor inertia, friction and offset to the motor torque minus the load."""
    tables, torques = [], []
    for motor, load in zip(motors, loads, strict=True):
        if motor.tau is None:
            return None
        inner = slice(len(motor) // 20, -(len(motor) // 20) - 1)
        sections = butter(4, CUTOFF, fs=1.0 / (motor.t[1] - motor.t[0]), output='sos')
        signs = sosfiltfilt(sections, direction(motor.dq), axis=0)
        columns = [motor.ddq, motor.dq, signs, np.ones_like(motor.q)]
        tables.append(np.column_stack([column[inner, joint] for column in columns]))
        torques.append((motor.tau - load)[inner, joint])
    found = np.linalg.lstsq(np.vstack(tables), np.concatenate(torques), rcond=None)[0]
    return np.asarray(found[:3])
