# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stiffness of each joint from encoders on both sides of its transmission.

The twist between motor and link is compliance times transmission torque, plus half the backlash
towards the loaded flank. A twist proportional to the velocity is fitted as well, for a delay
between the encoders.

The torque of a spring is that of inverse dynamics along the motion of the links. The rest of the
motor torque is rotor inertia, viscous and Coulomb friction. Both models are linear, and slow
motion is sufficient. The resonances follow from inertia and stiffness. Filters, decimation and
standard deviations are those of the identification of rigid arms.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import Conditioning
from armid_ros.identification.fitting.covariance import sandwich, score_products
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.identification.rows.signals import decimate, no_stretch, segments
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.elastic.identification.interaction import direction
from armid_ros.recording import recorded_together, Recording
from armid_ros.robots import Robot
import numpy as np
import pinocchio as pin
from scipy.linalg import block_diag

#: Cut-off of the signals [Hz].
_CUTOFF = 8.0
#: Filtered motions of motors (at the joints) and of links, and torques of the springs, (N, n).
Sides = tuple[Motion, Motion, FloatArray]


@dataclass(frozen=True, eq=False)
class TransmissionFit:
    """
    Stiffness and backlash of one joint, with 95 % intervals.

    Attributes
    ----------
    stiffness : tuple of float
        Value, lower and upper bound [N m/rad]; the model includes backlash.
    backlash : tuple of float
        Value, lower and upper bound [rad]; NaN and infinite bounds if the load changes its sign
        too rarely.
    delay : tuple of float
        Delay of the link encoder after the motor encoder [s]: twist per velocity.
    correlation : float
        Correlation of compliance and backlash; near -1 or 1 they are not distinguishable.
    explained : float
        R^2 of the twist.

    """

    stiffness: tuple[float, float, float]
    backlash: tuple[float, float, float]
    delay: tuple[float, float, float]
    correlation: float
    explained: float

    @property
    def backlash_seen(self) -> bool:
        """Whether backlash is significant and distinguishable from compliance."""
        return self.backlash[1] > 0.0 and abs(self.correlation) < 0.95


def fit_transmission(sides: Sequence[Sides], used: Conditioning, joint: int) -> TransmissionFit:
    """
    Fit compliance and backlash of a joint to the twist between its motor and its link.

    Parameters
    ----------
    sides : sequence of Sides
        Unbroken stretches; each has its own offset and scale between the two encoders.
    used : Conditioning
        Filter and decimation of the stretches.
    joint : int
        Index of the joint.

    Raises
    ------
    IdentificationError
        If the joint moves too little.

    """
    pieces = [_columns(stretch, used, joint) for stretch in sides]
    shared = np.vstack([own[:, :3] for own, _ in pieces])
    twist = np.concatenate([twist for _, twist in pieces])
    if len(twist) < 50:
        raise IdentificationError(
            'the joint hardly moves, so its stiffness is not identifiable; record larger motion'
        )
    table = np.hstack([shared, block_diag(*(own[:, 3:] for own, _ in pieces))])
    # smallest number of load reversals for an estimate of backlash
    reverses = sum(np.count_nonzero(np.diff(np.sign(own[:, 0]))) for own, _ in pieces) >= 4
    if not reverses:
        table[:, 1] = 0.0
    scale = np.linalg.norm(table, axis=0)
    scale[scale <= 0.0] = 1.0
    bread = np.linalg.pinv((table / scale).T @ (table / scale), hermitian=True)
    found = bread @ ((table / scale).T @ twist) / scale
    residual = twist - table @ found
    cuts = np.cumsum([len(own) for own, _ in pieces])[:-1]
    scores = np.split(table / scale * residual[:, np.newaxis], cuts)
    # errors are correlated over half a second
    lags = max(1, round(0.5 * used.rate_hz / used.decimation))
    freedom = len(twist) / max(len(twist) - table.shape[1], 1)
    covariance = freedom * sandwich(bread, score_products(scores, lags))
    std = np.sqrt(np.diag(covariance)) / scale
    compliance, low, high = _interval(found[0], std[0])
    # the interval of the stiffness is unbounded if that of the compliance contains zero
    stiffness = [1.0 / c if c > 0.0 else np.inf for c in (compliance, high, low)]
    backlash, correlation = (np.nan, -np.inf, np.inf), np.nan
    if reverses:
        backlash = _interval(2.0 * found[1], 2.0 * std[1])
        correlation = float(bread[0, 1] / np.sqrt(bread[0, 0] * bread[1, 1]))
    return TransmissionFit(
        (stiffness[0], stiffness[1], stiffness[2]),
        backlash,
        _interval(found[2], std[2]),
        correlation,
        1.0 - float(residual @ residual / np.sum((twist - twist.mean()) ** 2)),
    )


def _columns(sides: Sides, used: Conditioning, joint: int) -> tuple[FloatArray, FloatArray]:
    """Return regressor and twist (motor minus link angle [rad]) of samples in motion."""
    motor, link, torque = sides[0].q[:, joint], sides[1].q[:, joint], sides[2][:, joint]
    velocity = sides[0].dq[:, joint]
    # torque range in which the tooth contact reverses, as a share of the median torque
    flank = np.tanh(torque / (0.05 * np.median(np.abs(torque))))
    ones = np.ones(len(motor))
    rows = decimate(np.column_stack([torque, flank, velocity, motor, ones, motor - link]), used)
    # velocity below which a joint is at rest, as a share of the largest velocity
    moving = np.abs(rows[:, 2]) > 0.02 * np.abs(velocity).max()
    return rows[moving, :5], rows[moving, 5]


def _interval(value: float, std: float) -> tuple[float, float, float]:
    return float(value), float(value - HALF_WIDTH * std), float(value + HALF_WIDTH * std)


@dataclass(frozen=True, eq=False)
class SpringEstimate:
    """
    Estimated stiffness, backlash, motor friction and inertias of one joint.

    Attributes
    ----------
    joint : str
        Its name.
    transmission : TransmissionFit
        Stiffness and backlash.
    motor : ndarray, shape (3,), or None
        Rotor inertia [kg m^2], viscous friction [N m s/rad] and Coulomb torque [N m] of the motor
        at the joint; None if no torque was recorded.
    inertia : float
        Link inertia about the joint while the other joints are locked, mean over the recording
        [kg m^2].

    """

    joint: str
    transmission: TransmissionFit
    motor: FloatArray | None
    inertia: float

    @property
    def informative(self) -> bool:
        """Whether the load torque explains the twist, so that the stiffness is identifiable."""
        fit = self.transmission
        # smallest R^2 of the twist for an estimate of stiffness
        return fit.explained > 0.9 and bool(np.isfinite(fit.stiffness).all())

    @property
    def antiresonance(self) -> float:
        """Natural frequency of the link on the joint spring while the motor is locked [Hz]."""
        return float(np.sqrt(self.transmission.stiffness[0] / self.inertia) / (2.0 * np.pi))

    @property
    def resonance(self) -> float:
        """Natural frequency of motor against link [Hz]; NaN if the rotor inertia is unknown."""
        if self.motor is None or self.motor[0] <= 0.0:
            return float('nan')
        return float(self.antiresonance * np.sqrt(1.0 + self.inertia / self.motor[0]))


def fit_springs(
    robot: Robot, recordings: Sequence[tuple[Recording, Recording]]
) -> list[SpringEstimate]:
    """
    Fit stiffness, backlash and motor parameters of each joint of an arm.

    Parameters
    ----------
    robot : Robot
        Robot with known inertias and gravity.
    recordings : sequence of (Recording, Recording)
        Recordings of motors (at the joints) and of links, of one clock.

    Raises
    ------
    IdentificationError
        If no stretch is long enough, or a joint hardly moves.

    """
    rate = float(np.median([1.0 / motors.period for motors, _ in recordings]))
    used = Conditioning(rate, _CUTOFF, max(1, int(rate / (2.5 * _CUTOFF))))
    sides = [one for pair in recordings for one in _stretches(robot, *pair, used)]
    if not sides:
        raise no_stretch(recordings[0][0], used)
    q = np.concatenate([link.q for _, link, _ in sides])
    data = robot.model.createData()
    chosen = q[np.linspace(0, len(q) - 1, 200).astype(int)]
    diagonals = [np.diag(pin.crba(robot.model, data, pose)).copy() for pose in chosen]
    inertia = np.asarray(np.mean(diagonals, axis=0))
    measured = all(motors.tau is not None for motors, _ in recordings)
    found = []
    for j, joint in enumerate(robot.joints):
        try:
            fit = fit_transmission(sides, used, j)
        except IdentificationError as error:
            raise IdentificationError(f"joint '{joint}': {error}") from None
        motor = _motor(sides, used, j) if measured else None
        found.append(SpringEstimate(joint, fit, motor, float(inertia[j])))
    return found


def _stretches(
    robot: Robot, motors: Recording, links: Recording, used: Conditioning
) -> list[Sides]:
    """Return filtered motor and link motions and spring torques of each gap-free section."""
    both = recorded_together(motors, links, robot)
    assert both.partner is not None
    tau = np.zeros_like(both.q) if both.tau is None else both.tau
    motor = replace(both, partner=None, tau=tau)
    link = replace(motor, q=both.partner.q)
    parts = zip(segments(motor, used), segments(link, used), strict=True)
    return [(of_motor, of_link, inverse_dynamics(robot, of_link)) for of_motor, of_link in parts]


def _motor(sides: Sequence[Sides], used: Conditioning, joint: int) -> FloatArray:
    """Fit rotor inertia and two friction parameters, (3,), to motor minus load torque."""
    rows = []
    for motor, _, load in sides:
        assert motor.tau is not None
        signs, torque = direction(motor.dq), motor.tau - load
        columns = [motor.ddq, motor.dq, signs, np.ones_like(motor.q), torque]
        rows.append(decimate(np.column_stack([column[:, joint] for column in columns]), used))
    table = np.vstack(rows)
    return np.asarray(np.linalg.lstsq(table[:, :4], table[:, 4], rcond=None)[0][:3])
