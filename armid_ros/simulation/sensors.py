# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the sensors of an arm make of its motion: noise, encoder steps, delay."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.errors import ModelError
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt


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
