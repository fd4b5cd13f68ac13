# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Periodic joint trajectories: finite Fourier series."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.motion import FloatArray, freeze, Motion
import numpy as np
import numpy.typing as npt

#: Samples before and after a period on which regressor columns of effects may depend.
MARGIN = 8


@dataclass(frozen=True)
class FourierTrajectory:
    """
    A periodic motion of all joints, one finite Fourier series per joint.

    With w = 2 pi / period and k = 1 ... H,

        q_j(t)   = q0_j + sum_k a_jk sin(k w t) / (k w) - b_jk cos(k w t) / (k w),
        dq_j(t)  =        sum_k a_jk cos(k w t)         + b_jk sin(k w t),

    so that a and b are velocity amplitudes.
    Source: Swevers, Ganseman, Tukel, De Schutter and Van Brussel 1997, eq. 8.

    Attributes
    ----------
    joints : tuple of str
        n joint names.
    period : float
        Duration of one period [s].
    q0 : ndarray, shape (n,)
        Mean position over a period [rad or m].
    a, b : ndarray, shape (n, H)
        Amplitudes of the cosines and sines of the velocity [rad/s or m/s].

    """

    joints: tuple[str, ...]
    period: float
    q0: FloatArray
    a: FloatArray
    b: FloatArray

    def __post_init__(self) -> None:
        """Freeze the Fourier coefficients, and check their shapes and values."""
        object.__setattr__(self, 'joints', tuple(self.joints))
        freeze(self, 'q0', 'a', 'b')
        n = len(self.joints)
        if len(set(self.joints)) != n:
            raise TrajectoryError(
                f'Fourier trajectory: a joint is named twice: {", ".join(self.joints)}'
            )
        if (
            self.q0.shape != (n,)
            or self.a.ndim != 2
            or self.a.shape != self.b.shape
            or self.a.shape[0] != n
            or self.a.shape[1] < 1
        ):
            raise TrajectoryError(
                f'Fourier trajectory: q0 has shape {self.q0.shape}, a {self.a.shape} and b '
                f'{self.b.shape}; {n} joints with H harmonics need ({n},), ({n}, H) and ({n}, H)'
            )
        if not (np.isfinite(self.period) and self.period > 0.0):
            raise TrajectoryError(
                f'Fourier trajectory: its period, {self.period} s, has to be positive'
            )
        for name in ('q0', 'a', 'b'):
            bad = ~np.isfinite(getattr(self, name).reshape(n, -1)).all(axis=1)
            if bad.any():
                raise TrajectoryError(
                    f'Fourier trajectory: {name} of joint {self.joints[int(bad.argmax())]} '
                    'is not a finite number'
                )

    @classmethod
    def of(cls, joints: tuple[str, ...], period: float, x: FloatArray) -> FourierTrajectory:
        """Return the trajectory with coefficient matrix x = (q0, a, b), shape (n, 1 + 2 H)."""
        middle = (x.shape[1] + 1) // 2
        return cls(joints, period, x[:, 0], x[:, 1:middle], x[:, middle:])

    @property
    def coefficients(self) -> FloatArray:
        """Return the coefficient matrix (q0, a, b) of all joints, shape (n, 1 + 2 H)."""
        return np.column_stack([self.q0, self.a, self.b])

    @property
    def n_joints(self) -> int:
        """Return the number of joints n."""
        return len(self.joints)

    @property
    def harmonics(self) -> int:
        """Return the number of harmonics H."""
        return int(self.a.shape[1])

    @property
    def angular_frequency(self) -> float:
        """Return the angular frequency w of the first harmonic [rad/s]."""
        return 2.0 * np.pi / self.period

    def motion(self, t: npt.ArrayLike) -> Motion:
        """
        Evaluate position, velocity and acceleration of the trajectory.

        Parameters
        ----------
        t : array_like, shape (N,)
            Time [s]; any real number, the trajectory is periodic.

        Returns
        -------
        Motion
            Motion without torque.

        """
        time = np.asarray(t, dtype=float)
        x = self.coefficients.T
        states = np.empty((3, len(time), self.n_joints))
        # the basis of all samples of hundreds of harmonics would take gigabytes
        for block in np.array_split(np.arange(len(time)), len(time) * len(x) // 4_000_000 + 1):
            basis = fourier_basis(time[block], self.period, self.harmonics)
            states[:, block] = [one @ x for one in basis]
        return Motion(self.joints, time, *states)

    def one_period(self, n_samples: int) -> Motion:
        """Return n_samples equally spaced samples of one period of the trajectory."""
        return self.motion(np.arange(n_samples) * (self.period / n_samples))

    def with_margins(self, n_samples: int) -> Motion:
        """Return samples of one period, and `MARGIN` further samples before and after it."""
        step = self.period / n_samples
        return self.motion(np.arange(-MARGIN, n_samples + MARGIN) * step)

    def shifted(self, time: float) -> FourierTrajectory:
        """Return the same periodic motion, started `time` [s] later within its period."""
        angle = self.angular_frequency * time * np.arange(1, self.harmonics + 1)
        cosine, sine = np.cos(angle), np.sin(angle)
        a = self.a * cosine + self.b * sine
        return replace(self, a=a, b=self.b * cosine - self.a * sine)

    def scaled(self, factor: npt.ArrayLike) -> FourierTrajectory:
        """Return the trajectory with each joint's amplitudes multiplied by a factor, (n,)."""
        factors = np.broadcast_to(np.asarray(factor, dtype=float), (self.n_joints,))[:, np.newaxis]
        return replace(self, a=self.a * factors, b=self.b * factors)

    def stretched(self, period: float) -> FourierTrajectory:
        """Return the trajectory along the same path, with another period [s]."""
        ratio = self.period / period
        return replace(self, period=period, a=self.a * ratio, b=self.b * ratio)

    def acceleration_bound(self) -> FloatArray:
        """Return an upper bound on the acceleration of each joint, (n,) [rad/s^2 or m/s^2]."""
        k = self.angular_frequency * np.arange(1, self.harmonics + 1)
        return np.asarray((k * np.hypot(self.a, self.b)).sum(axis=1))


def fourier_basis(
    t: FloatArray, period: float, harmonics: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Evaluate the Fourier basis of the position, velocity and acceleration of a joint.

    Parameters
    ----------
    t : ndarray, shape (N,)
        Time [s].
    period : float
        Period [s].
    harmonics : int
        Number of harmonics H.

    Returns
    -------
    q, dq, ddq : ndarray, shape (N, 1 + 2 H)
        Coefficients in the order (q0, a_1 ... a_H, b_1 ... b_H): q(t) = q_basis @ x.

    """
    k = 2.0 * np.pi / period * np.arange(1, harmonics + 1)
    angle = np.multiply.outer(t, k)
    cosine, sine = np.cos(angle), np.sin(angle)
    one, zero = np.ones((len(t), 1)), np.zeros((len(t), 1))
    q = np.concatenate([one, sine / k, -cosine / k], axis=1)
    dq = np.concatenate([zero, cosine, sine], axis=1)
    ddq = np.concatenate([zero, -sine * k, cosine * k], axis=1)
    return q, dq, ddq
