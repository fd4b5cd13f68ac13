# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sensors of a simulated arm: noise, quantisation, delays, effects on readings, accelerometers."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.effects import Action
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import Robot
from armid_ros.simulation.closed_loop import Trace
from armid_ros.simulation.plant import Plant, State
import numpy as np
import pinocchio as pin


@dataclass(frozen=True, eq=False)
class Sensors:
    """
    Encoders and torque sensors of an arm, by default without errors.

    Attributes
    ----------
    torque_noise : float or ndarray, shape (n,)
        Standard deviation of the torque noise [N m].
    position_noise : float or ndarray, shape (n,)
        Standard deviation of the position noise, before quantisation [rad or m].
    velocity_noise : float or ndarray, shape (n,)
        Standard deviation of the velocity noise [rad/s or m/s].
    resolution : float or ndarray, shape (n,)
        Step of the encoder [rad or m]; 0: no quantisation.
    torque_delay : int
        Steps of the plant by which the torque reading is older than the position reading.
    acceleration_noise : float
        Standard deviation of accelerometers on the links, if any [m/s^2].

    """

    torque_noise: float | FloatArray = 0.0
    position_noise: float | FloatArray = 0.0
    velocity_noise: float | FloatArray = 0.0
    resolution: float | FloatArray = 0.0
    torque_delay: int = 0
    acceleration_noise: float = 0.0
    _noisy: bool = field(init=False, repr=False)
    _step: FloatArray | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Raise a ModelError for invalid values; precompute noise flag and encoder steps."""
        noises = ('torque_noise', 'position_noise', 'velocity_noise', 'acceleration_noise')
        for setting in (*noises, 'resolution'):
            value = np.asarray(getattr(self, setting), dtype=float)
            if not np.all(np.isfinite(value)) or np.any(value < 0.0):
                raise ModelError(f'sensors: {setting} has to be 0 or more, not {value.tolist()}')
        if self.torque_delay < 0 or int(self.torque_delay) != self.torque_delay:
            raise ModelError(
                f'sensors: torque_delay has to be a whole number of steps, 0 or more, not '
                f'{self.torque_delay}'
            )
        std = (self.torque_noise, self.position_noise, self.velocity_noise)
        object.__setattr__(self, '_noisy', any(np.any(each) for each in std))
        step = np.where(self.resolution, self.resolution, 1.0) if np.any(self.resolution) else None
        object.__setattr__(self, '_step', step)

    def measure(
        self,
        q: FloatArray,
        dq: FloatArray,
        tau: FloatArray,
        rng: np.random.Generator,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Add sensor noise and quantisation to successive samples; the caller applies the delay.

        Parameters
        ----------
        q, dq, tau : ndarray, shape (N, n)
            True position, velocity and torque.
        rng : numpy.random.Generator
            Source of the noise; N samples at once give the same noise as N single samples.

        Returns
        -------
        q, dq, tau : ndarray, shape (N, n)
            The readings.

        """
        if self._noisy:
            noise = rng.standard_normal((len(q), 3, q.shape[1]))
            q = q + noise[:, 0] * self.position_noise
            dq = dq + noise[:, 1] * self.velocity_noise
            tau = tau + noise[:, 2] * self.torque_noise
        if self._step is not None:
            q = np.where(self.resolution, np.rint(q / self._step) * self._step, q)
        return q, dq, tau


def readings(
    action: Action, truth: Motion, commanded: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return the sensor readings of a true motion and torque, before noise is added.

    Parameters
    ----------
    action : Action
        Action of the effects.
    truth : Motion
        True motion and torque, at every step of the plant.
    commanded : ndarray, shape (N, n)
        Commanded torque, which the drives report [N m].

    Returns
    -------
    q, dq, tau : ndarray, shape (N, n)
        Position, velocity and torque as read.

    """
    q, dq, tau = truth.q, truth.dq, commanded
    if action.reading is not None:
        assert truth.tau is not None
        tau = action.reading(truth.with_torque(commanded), truth.tau)
    if action.displacement is not None:
        beyond = action.displacement(truth)
        q, dq = q - beyond.q, dq - beyond.dq
    return q, dq, tau


class RecentPast:
    """
    Latest true samples of an arm, from which delayed or filtered readings are computed.

    Parameters
    ----------
    plant : Plant
        The arm.
    state : State
        The initial state.
    torque : ndarray, shape (n,)
        The commanded torque in that state [N m].
    delay : int
        Delay of the torque sensors, in steps.

    """

    def __init__(self, plant: Plant, state: State, torque: FloatArray, delay: int = 0) -> None:
        self._plant = plant
        self._delay = delay
        memory = int(np.ceil(plant.sensing.reading_memory / plant.dt))
        # additional samples for derivatives
        self._length = memory + delay + 8
        given = torque if plant.action.drive is None else plant.action.drive(torque)
        q, dq, _ = plant.motors(state)
        self._rows = np.stack([q, dq, np.zeros_like(q), given, torque])[:, np.newaxis]
        self._steps = state.steps

    def extend(self, trace: Trace) -> None:
        """
        Append the samples of a simulated trace.

        Torque is constant over a step. With rigid joints, the reading between two steps is the
        mean of their torques, because the acceleration jumps with the torque. With elastic joints,
        the reading is the torque of the next step.

        """
        rows = np.empty((5, len(trace.tau) - 1, trace.tau.shape[1]))
        rows[:3], rows[3:] = trace.motors[:, 1:], self._read(trace.tau)
        drive = self._plant.action.drive
        if drive is not None:
            rows[3] = self._read(drive(trace.tau))
        self._rows = np.concatenate([self._rows[:, -self._length :], rows], axis=1)
        self._steps = trace.state.steps

    def _read(self, tau: FloatArray) -> FloatArray:
        """Return the torque readings at the ends of steps, from the torques during the steps."""
        return (tau[1:] + tau[:-1]) / 2 if self._plant.springs is None else tau[1:]

    def drop(self, count: int) -> None:
        """Remove the latest `count` samples."""
        self._rows, self._steps = self._rows[:, :-count], self._steps - count

    def latest(self, ahead: int = 0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Return the latest readings of position, velocity and torque, each of shape (n,).

        Parameters
        ----------
        ahead : int
            Number of samples of the last trace that are later than the readings.

        """
        end = self._rows.shape[1] - ahead
        rows, sensing = self._rows[:, max(end - self._length, 0) : end], self._plant.sensing
        count = rows.shape[1]
        q, dq, ddq, given, commanded = rows
        late = max(-1 - self._delay, -count)
        if count == 1 or (sensing.reading is None and sensing.displacement is None):
            return q[-1], dq[-1], commanded[late]
        t = self._plant.times(self._steps - ahead - count + 1, count)
        truth = Motion(self._plant.robot.joints, t, q, dq, ddq, given)
        q, dq, tau = readings(sensing, truth, commanded)
        return q[-1], dq[-1], tau[late]


def accelerometer_readings(robot: Robot, links: Motion, places: FloatArray) -> FloatArray:
    """
    Return the readings of three-axis accelerometers, one on every link, along a motion.

    Parameters
    ----------
    robot : Robot
        The arm.
    links : Motion
        True motion of its n links, N samples.
    places : ndarray, shape (n, 3)
        Positions of the accelerometers in the frames of the joints [m], to which they are aligned.

    Returns
    -------
    ndarray, shape (n, N, 3)
        Acceleration minus gravity [m/s^2].

    """
    model, data = robot.model, robot.model.createData()
    readings = np.empty((len(places), len(links), 3))
    for k, states in enumerate(zip(links.q, links.dq, links.ddq, strict=True)):
        pin.forwardKinematics(model, data, *robot.state(*states))
        for joint, place in enumerate(places, 1):
            here = pin.SE3(np.eye(3), place)
            felt = pin.getFrameClassicalAcceleration(model, data, joint, here, pin.LOCAL).linear
            readings[joint - 1, k] = felt - model.gravity.linear.dot(data.oMi[joint].rotation)
    return readings
