# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Springs of any arm, joint by joint, from encoders on both sides of its transmissions.

The twist between motor and link is compliance times transmission torque, plus half the backlash
towards the loaded flank. A twist proportional to the velocity is fitted as well, for a delay
between the encoders.

The torque of a spring is that of inverse dynamics along the motion of the links. The rest of the
motor torque is rotor inertia, viscous and Coulomb friction. Both models are linear, and slow
motion is sufficient. The resonances follow from inertia and stiffness.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.errors import IdentificationError
from armid_ros.model import inverse_dynamics
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.elastic.identification.interaction import direction
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.linalg import block_diag
from scipy.signal import butter, sosfiltfilt

IntArray = npt.NDArray[np.intp]

#: Cut-off of the signals [Hz].
_CUTOFF = 8.0

#: Time between samples [s], positions of motor and link at the joint [rad], and torque of the
#: spring [N m], each of shape (N,).
TwoEncoders = tuple[float, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class TransmissionFit:
    """
    Stiffness and free play of one joint, with 95 % intervals.

    Attributes
    ----------
    stiffness : tuple of float
        Value, lower and upper bound with free play as a part of the model [N m/rad].
    backlash : tuple of float
        Total free play [rad]; NaN with infinite bounds if the load changes flanks too rarely.
    delay : tuple of float
        Twist per velocity: delay of the link encoder after the motor encoder [s].
    correlation : float
        Of compliance and backlash, -1 to 1; near either end the two are collinear.
    explained : float
        R^2 of the whole model.

    """

    stiffness: tuple[float, float, float]
    backlash: tuple[float, float, float]
    delay: tuple[float, float, float]
    correlation: float
    explained: float

    @property
    def backlash_seen(self) -> bool:
        """Whether free play exceeds its uncertainty and is identifiable apart from the spring."""
        return self.backlash[1] > 0.0 and abs(self.correlation) < 0.95


def fit_transmission(records: Sequence[TwoEncoders], rng: np.random.Generator) -> TransmissionFit:
    """
    Fit spring and free play to recordings of one joint.

    Parameters
    ----------
    records : sequence of TwoEncoders
        Recordings; each has its own offset and slope between the encoders.
    rng : numpy.random.Generator
        Random numbers for the bootstrap blocks of the intervals.

    Raises
    ------
    IdentificationError
        If the joint moves too little.

    """
    pieces = [_columns(record) for record in records]
    if sum(len(twist) for _, twist, _, _ in pieces) < 50:
        raise IdentificationError('the joint hardly moves: its stiffness cannot be found')
    table, twist, blocks = _stacked_recordings(pieces)
    reversals = sum(count for _, _, _, count in pieces)
    # number of draws of bootstrap blocks
    draws = [rng.choice(len(blocks), len(blocks)) for _ in range(400)]
    backlash, correlation = (np.nan, -np.inf, np.inf), np.nan
    # smallest number of flank changes for an estimate of free play
    if reversals < 4:
        table[:, 1] = 0.0
    found, spread = _drawn(table, twist, blocks, draws)
    if reversals >= 4:
        backlash = _interval(2.0 * found[1], 2.0 * spread[:, 1])
        correlation = float(np.corrcoef(spread[:, 0], spread[:, 1])[0, 1])
    residual = twist - table @ found
    # the interval of the stiffness is unbounded if that of the compliance contains zero
    compliance, lower, upper = _interval(found[0], spread[:, 0])
    stiffness = [1.0 / c if c > 0.0 else np.inf for c in (compliance, upper, lower)]
    return TransmissionFit(
        (stiffness[0], stiffness[1], stiffness[2]),
        backlash,
        _interval(found[2], spread[:, 2]),
        correlation,
        1.0 - float(residual @ residual / np.sum((twist - twist.mean()) ** 2)),
    )


def _columns(record: TwoEncoders) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return columns, twist, times and the number of flank changes of one recording."""
    dt, *signals = record
    sections = butter(4, _CUTOFF, fs=1.0 / dt, output='sos')
    motor, link, torque = (sosfiltfilt(sections, x) for x in signals)
    velocity = np.gradient(motor, dt)
    # velocity below which a joint is at rest, as a share of the largest velocity
    moving = np.abs(velocity) > 0.02 * np.abs(velocity).max()
    ends = round(0.3 / dt)
    moving[:ends] = moving[-ends:] = False
    moving &= np.arange(len(moving)) % max(round(0.25 / _CUTOFF / dt), 1) == 0
    # torque range in which the flank changes, as a share of the median torque
    flank = np.tanh(torque / (0.05 * np.median(np.abs(torque))))
    own = np.column_stack([torque, flank, velocity, motor, np.ones(len(motor))])
    changes = int(np.count_nonzero(np.diff(np.sign(torque[moving]))))
    times = np.asarray(dt * np.flatnonzero(moving), dtype=np.float64)
    return own[moving], np.asarray((motor - link)[moving]), times, changes


def _stacked_recordings(
    pieces: Sequence[tuple[FloatArray, FloatArray, FloatArray, int]],
) -> tuple[FloatArray, FloatArray, list[IntArray]]:
    """Stack recordings, with own slope and offset of each, and cut them into blocks."""
    shared = np.vstack([own[:, :-2] for own, *_ in pieces])
    table = np.hstack([shared, block_diag(*(own[:, -2:] for own, *_ in pieces))])
    blocks: list[IntArray] = []
    first = 0
    for _, _, t, _ in pieces:
        labels = (t / 0.5).astype(int)  # bootstrap blocks of 0.5 s
        blocks += [first + np.flatnonzero(labels == label) for label in np.unique(labels)]
        first += len(t)
    return table, np.concatenate([twist for _, twist, _, _ in pieces]), blocks


def _drawn(
    table: FloatArray, twist: FloatArray, blocks: list[IntArray], draws: list[IntArray]
) -> tuple[FloatArray, FloatArray]:
    """Return the least-squares solution, and the solutions of random sets of blocks."""
    scale = np.linalg.norm(table, axis=0)
    scale[scale <= 0.0] = 1.0
    scaled = table / scale
    normal = np.array([scaled[b].T @ scaled[b] for b in blocks])
    right = np.array([scaled[b].T @ twist[b] for b in blocks])
    found = np.linalg.lstsq(scaled, twist, rcond=None)[0]
    spread = np.array(
        [
            np.linalg.lstsq(normal[d].sum(axis=0), right[d].sum(axis=0), rcond=None)[0]
            for d in draws
        ]
    )
    return found / scale, spread / scale


def _interval(value: float, spread: FloatArray) -> tuple[float, float, float]:
    lower, upper = np.quantile(spread, [0.025, 0.975])
    return float(value), float(lower), float(upper)


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
        # smallest R^2 of the twist for an estimate of stiffness
        return fit.explained > 0.9 and bool(np.isfinite(fit.stiffness).all())

    @property
    def antiresonance(self) -> float:
        """Natural frequency of the link on its spring with a blocked motor [Hz]."""
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
    shortest = 2.0  # used stretch [s]
    stretches = [piece for pair in sides for piece in _stretches(*pair, shortest)]
    if not stretches:
        raise IdentificationError(
            f'springs: there is no stretch of {shortest:g} s without a pause in the recordings'
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
            (float(motor.t[1] - motor.t[0]), motor.q[:, j], link.q[:, j], load[:, j])
            for (motor, link), load in zip(stretches, loads, strict=True)
        ]
        try:
            fit = fit_transmission(records, rng)
        except IdentificationError as error:
            raise IdentificationError(f"joint '{joint}': {error}") from None
        own = _motor([motor for motor, _ in stretches], loads, j)
        found.append(SpringEstimate(joint, fit, own, float(inertia[j])))
    return found


def _stretches(
    motors: Recording, links: Recording, shortest: float
) -> list[tuple[Motion, Motion]]:
    """Return filtered motions of motors and links without pauses, with the motor torque."""
    period = motors.period
    sections = butter(4, _CUTOFF, fs=1.0 / period, output='sos')

    def smooth(at: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
        even = np.column_stack([np.interp(at, times, column) for column in values.T])
        return np.asarray(sosfiltfilt(sections, even, axis=0))

    link_times = links.t + 1e-9 * (links.start_ns - motors.start_ns)
    cuts = np.flatnonzero(np.diff(motors.t) > 5.0 * period) + 1
    pieces = []
    for rows in np.split(np.arange(len(motors)), cuts):
        if len(rows) * period < shortest:
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
        sections = butter(4, _CUTOFF, fs=1.0 / (motor.t[1] - motor.t[0]), output='sos')
        signs = sosfiltfilt(sections, direction(motor.dq), axis=0)
        columns = [motor.ddq, motor.dq, signs, np.ones_like(motor.q)]
        tables.append(np.column_stack([column[inner, joint] for column in columns]))
        torques.append((motor.tau - load)[inner, joint])
    found = np.linalg.lstsq(np.vstack(tables), np.concatenate(torques), rcond=None)[0]
    return np.asarray(found[:3])
