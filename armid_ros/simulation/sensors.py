# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What sensors, and the effects of an arm, make of its motion: noise, steps, delays, gains."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.effects import Action
from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray, Motion
from armid_ros.simulation.closed_loop import Trace
from armid_ros.simulation.plant import Plant, State
import numpy as np
import numpy.typing as npt

#: Extra samples around those that a reading depends on, for its rates of change.
_NEIGHBOURS = 8


@dataclass(frozen=True, eq=False)
class Sensors:
    """
    Encoders and torque sensors of an arm; perfect unless told otherwise.

    Attributes
    ----------
    torque_noise : float or ndarray, shape (n,)
        Standard deviation of the torque [N m].
    position_noise : float or ndarray, shape (n,)
        Standard deviation of the position, before quantisation [rad or m].
    velocity_noise : float or ndarray, shape (n,)
        Standard deviation of the velocity [rad/s or m/s].
    resolution : float or ndarray, shape (n,)
        Step of the encoder [rad or m]; 0 for none.
    velocity_from_encoder : bool
        Whether the velocity is the difference of the last two positions as measured, divided by
        the time between them, instead of the true one; the noise comes on top.
    torque_delay : int
        Steps of the plant by which the torque reading is older than the position reading.
    acceleration_noise : float
        Standard deviation of accelerometers on the links, where an arm has them [m/s^2].

    """

    torque_noise: float | FloatArray = 0.0
    position_noise: float | FloatArray = 0.0
    velocity_noise: float | FloatArray = 0.0
    resolution: float | FloatArray = 0.0
    velocity_from_encoder: bool = False
    torque_delay: int = 0
    acceleration_noise: float = 0.0
    _noisy: bool = field(init=False, repr=False)
    _counted: npt.NDArray[np.bool_] | None = field(init=False, repr=False)
    _size: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse negative values, and see what there is to do."""
        noises = ('torque_noise', 'position_noise', 'velocity_noise', 'acceleration_noise')
        for name in (*noises, 'resolution'):
            value = np.asarray(getattr(self, name), dtype=float)
            if not np.all(np.isfinite(value)) or np.any(value < 0.0):
                raise ModelError(f'sensors: {name} has to be 0 or more, not {value.tolist()}')
        if self.torque_delay < 0 or int(self.torque_delay) != self.torque_delay:
            raise ModelError(
                f'sensors: torque_delay is a whole number of steps, not {self.torque_delay}'
            )

        resolution = np.asarray(self.resolution, dtype=float)
        object.__setattr__(
            self, '_noisy', any(np.any(np.asarray(getattr(self, name))) for name in noises[:3])
        )
        object.__setattr__(self, '_counted', resolution > 0.0 if resolution.any() else None)
        object.__setattr__(self, '_size', np.where(resolution > 0.0, resolution, 1.0))

    def measure(
        self,
        q: FloatArray,
        dq: FloatArray,
        tau: FloatArray,
        dt: float,
        rng: np.random.Generator,
        previous: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Read successive samples of an arm; the delay is the caller's, who knows the past.

        Parameters
        ----------
        q, dq, tau : ndarray, shape (N, n)
            The truth.
        dt : float
            Time between samples [s].
        rng : numpy.random.Generator
            Source of the noise; N samples at once draw what N times one sample draw.
        previous : ndarray, shape (n,), or None
            Measured position one sample earlier; None at the beginning, where the arm is taken
            to have come with its true velocity.

        Returns
        -------
        q, dq, tau : ndarray, shape (N, n)
            The readings.

        """
        position, noise = q, None
        if self._noisy:
            noise = rng.standard_normal((len(q), 3, q.shape[1]))
            position = position + noise[:, 0] * self.position_noise
        position = self._quantise(position)
        if self.velocity_from_encoder:
            before = self._quantise(q[:1] - dt * dq[:1]) if previous is None else previous[None]
            dq = np.diff(np.concatenate([before, position]), axis=0) / dt
        if noise is not None:
            dq = dq + noise[:, 1] * self.velocity_noise
            tau = tau + noise[:, 2] * self.torque_noise
        return position, dq, tau

    def _quantise(self, q: FloatArray) -> FloatArray:
        if self._counted is None:
            return q
        return np.where(self._counted, np.rint(q / self._size) * self._size, q)


def readings(
    action: Action, truth: Motion, asked: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what sensors without noise read.

    Parameters
    ----------
    action : Action
        What the effects do.
    truth : Motion
        True motion and torque, at every step of the plant.
    asked : ndarray, shape (N, n)
        What the drives were asked for, which is what they report [N m].

    Returns
    -------
    q, dq, tau : ndarray, shape (N, n)
        Position, velocity and torque as read.

    """
    q, dq, tau = truth.q, truth.dq, asked
    if action.reading is not None:
        assert truth.tau is not None
        tau = action.reading(truth.with_torque(asked), truth.tau)
    if action.displacement is not None:
        beyond = action.displacement(truth)
        q, dq = q - beyond.q, dq - beyond.dq
    return q, dq, tau


class RecentPast:
    """
    The last samples of an arm, as many as its readings depend on.

    Parameters
    ----------
    plant : Plant
        The arm.
    state : State
        Where it starts.
    torque : ndarray, shape (n,)
        What its drives are asked for there [N m].
    delay : int
        Steps by which the torque sensors are late.

    """

    def __init__(self, plant: Plant, state: State, torque: FloatArray, delay: int = 0) -> None:
        self._plant = plant
        self._delay = delay
        memory = int(np.ceil(plant.sensing.reading_memory / plant.dt))
        self._length = memory + delay + _NEIGHBOURS
        given = torque if plant.action.drive is None else plant.action.drive(torque)
        q, dq, _ = plant.motors(state)
        self._rows = np.stack([q, dq, np.zeros_like(q), given, torque])[:, np.newaxis]
        self._steps = state.steps

    def extend(self, trace: Trace) -> None:
        """
        Take in what happened.

        Torque is constant over a step. Where joints are rigid, what is read between two steps is
        the mean of both, as the acceleration jumps with it; where motors have rotors of their
        own, it is what is given from now on.

        """
        rows = np.empty((5, len(trace.tau) - 1, trace.tau.shape[1]))
        rows[:3], rows[3:] = trace.motors[:, 1:], self._read(trace.tau)
        drive = self._plant.action.drive
        if drive is not None:
            rows[3] = self._read(drive(trace.tau))
        self._rows = np.concatenate([self._rows, rows], axis=1)[:, -self._length :]
        self._steps = trace.state.steps

    def _read(self, tau: FloatArray) -> FloatArray:
        """Return torques at the ends of steps from those of the steps."""
        return (tau[1:] + tau[:-1]) / 2 if self._plant.springs is None else tau[1:]

    def latest(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and torque as read now, each of shape (n,)."""
        count, sensing = self._rows.shape[1], self._plant.sensing
        q, dq, ddq, given, asked = self._rows
        late = max(-1 - self._delay, -count)
        if count == 1 or (sensing.reading is None and sensing.displacement is None):
            return q[-1], dq[-1], asked[late]
        t = self._plant.times(self._steps - count + 1, count)
        truth = Motion(self._plant.robot.joints, t, q, dq, ddq, given)
        q, dq, tau = readings(sensing, truth, asked)
        return q[-1], dq[-1], tau[late]
