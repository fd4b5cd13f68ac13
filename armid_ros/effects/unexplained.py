# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The residual torque in which effects are searched, and waves in this residual."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Number of returned orders, of likely orders that are refined, and of finer steps per step.
_MOST_PEAKS, _LIKELY, _FINER = 3, 12, 8


@dataclass(frozen=True)
class Unexplained:
    """
    Torque residual of a model, in rows of all recordings.

    Attributes
    ----------
    motion : Motion
        All samples, with the recordings concatenated.
    q : ndarray, shape (M, n)
        Positions of the rows [rad or m].
    residual : ndarray, shape (M, n)
        Residual torque [N m].
    weight : ndarray, shape (M, n)
        One over the standard deviation of the noise, zero for a row without information [1/(N m)].
    beside : ndarray, shape (M, n, f)
        Columns of parameters that are fitted together with any effect.

    """

    motion: Motion
    q: FloatArray
    residual: FloatArray
    weight: FloatArray
    beside: FloatArray

    def thinned(self, count: int) -> Unexplained:
        """Return the residual in a given number of rows, spread evenly."""
        rows = np.unique(np.linspace(0, len(self.q) - 1, count).astype(int))
        parts = (self.q, self.residual, self.weight, self.beside)
        return Unexplained(self.motion, *(part[rows] for part in parts))

    def rest(self, values: FloatArray) -> FloatArray:
        """Return values (M, n, A), weighted and orthogonal to `beside`, shape (M n, A)."""
        flat = self._weighted(values)
        return np.asarray(flat - self._basis @ (self._basis.T @ flat))

    def _weighted(self, values: FloatArray) -> FloatArray:
        scaled = values * self.weight[:, :, np.newaxis]
        return np.asarray(scaled.reshape(self.weight.size, -1))

    @cached_property
    def _basis(self) -> FloatArray:
        return np.linalg.qr(self._weighted(self.beside))[0]


def wave_orders(unexplained: Unexplained, joint: int, between: tuple[float, float]) -> FloatArray:
    """
    Return the orders of waves over a joint position that explain most of the residual, (K,).

    All recordings are used together, because a ripple has the same order and phase in each.

    Parameters
    ----------
    unexplained : Unexplained
        The residual.
    joint : int
        The joint.
    between : (float, float)
        The lowest and the highest order [1/rad or 1/m].

    """
    weight = unexplained.weight[:, joint]
    rows = weight > 0.0
    if not rows.any():
        return np.full(_MOST_PEAKS, between[0])
    angle, scale = unexplained.q[rows, joint], weight[rows]
    rest = unexplained.residual[rows, joint] * scale
    step = 0.5 * np.pi / max(float(np.ptp(angle)), 0.3 / between[0])
    orders = np.arange(*between, step)
    gain = wave_gains(angle, rest, scale, orders)
    padded = np.concatenate([[0.0], gain, [0.0]])
    peaks = np.flatnonzero((gain >= padded[:-2]) & (gain > padded[2:]))
    likely = orders[peaks[np.argsort(-gain[peaks])[:_LIKELY]]]
    likely = likely if len(likely) else orders[:1]
    fine = likely[:, np.newaxis] + step * np.linspace(-1.0, 1.0, 2 * _FINER + 1)
    gain = wave_gains(angle, rest, scale, fine.ravel()).reshape(fine.shape)
    best = np.argsort(-gain.max(axis=1))[:_MOST_PEAKS]
    return np.resize(fine[best, np.argmax(gain[best], axis=1)], _MOST_PEAKS)


def wave_gains(
    angle: FloatArray, rest: FloatArray, weight: FloatArray, orders: FloatArray
) -> FloatArray:
    """
    Return the reduction of the squared residual by a sine and cosine of each order, (K,).

    With few cycles, orders leak into each other; least squares separate them better than a
    spectrum.

    """
    wave = np.exp(1j * np.outer(orders, angle))
    aim, twice, count = wave @ (weight * rest), wave**2 @ weight**2, np.sum(weight**2)
    cosines, sines, mixed = count + twice.real, count - twice.real, twice.imag
    determinant = np.maximum(cosines * sines - mixed**2, 1e-6 * count**2)
    squares = sines * aim.real**2 - 2.0 * mixed * aim.real * aim.imag + cosines * aim.imag**2
    return np.asarray(2.0 * squares / determinant)
