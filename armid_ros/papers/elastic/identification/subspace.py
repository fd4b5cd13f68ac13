# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Subspace identification (PO-MOESP) of a linear system from several experiments.

Poles and output matrix come from the column space of the projection of future on past data. Past
inputs and outputs are the instruments (Verhaegen 1994; without past outputs, the ordinary MOESP
of Verhaegen and Dewilde 1992). The input matrix follows from a linear regression on whole
simulated experiments with free initial states. Each experiment has its own initial state; inputs
may vary within a sample, as interaction torques do.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from armid_ros.errors import IdentificationError
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

ComplexArray = npt.NDArray[np.complex128]
#: Interpolation of an input between samples: constant ('zero') or linear ('first').
Hold = Literal['zero', 'first']
#: Number of past samples, and of future samples.
_HORIZON = 24


@dataclass(frozen=True, eq=False)
class StateSpace:
    """
    Linear system x' = a x + b u, y = c x in continuous time and modal coordinates.

    Attributes
    ----------
    poles : ndarray of complex, shape (r,)
        Eigenvalues of a [rad/s].
    b : ndarray of complex, shape (r, m)
        Input gains of the modes.
    c : ndarray of complex, shape (p, r)
        Output gains of the modes.

    """

    poles: ComplexArray
    b: ComplexArray
    c: ComplexArray

    def response(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Return the frequency response, shape (K, p, m), at frequencies in Hz, shape (K,)."""
        s = 2j * np.pi * np.asarray(frequency, dtype=float)
        modal = self.b / (s[:, np.newaxis, np.newaxis] - self.poles[:, np.newaxis])
        return np.asarray(self.c @ modal)


@dataclass(frozen=True, eq=False)
class Signals:
    """
    Sampled inputs and outputs of one experiment.

    Attributes
    ----------
    u : ndarray, shape (N, m)
        Inputs.
    y : ndarray, shape (N, p)
        Outputs.

    """

    u: FloatArray
    y: FloatArray


def identify_subspace(
    experiments: Sequence[Signals], dt: float, order: int, hold: Sequence[Hold]
) -> StateSpace:
    """
    Identify a linear system with `order` states from sampled inputs and outputs.

    Parameters
    ----------
    experiments : sequence of Signals
        All with the same m inputs and p outputs.
    dt : float
        Time between samples [s].
    order : int
        Number of states r.
    hold : sequence of {'zero', 'first'}
        Interpolation of each input between samples.

    Raises
    ------
    IdentificationError
        If the data are too short, an input or output is always zero, or the poles are not those of
        a sampled system.

    """
    needed = 4 * _HORIZON * (experiments[0].u.shape[1] + experiments[0].y.shape[1])
    columns = sum(max(len(e.u) - 2 * _HORIZON + 1, 0) for e in experiments)
    if columns < needed:
        raise IdentificationError(
            f'the recordings are too short, record longer: apart from the first {2 * _HORIZON} '
            f'samples of each experiment, {needed} samples are needed, but there are {columns}'
        )
    u_scale, y_scale = (
        np.sqrt(np.mean(np.concatenate([getattr(e, name) for e in experiments]) ** 2, axis=0))
        for name in ('u', 'y')
    )
    if not (np.all(u_scale > 0.0) and np.all(y_scale > 0.0)):
        raise IdentificationError(
            'subspace identification: an input or an output is zero in all samples; record '
            'motion with torque'
        )
    scaled = [Signals(e.u / u_scale, e.y / y_scale) for e in experiments]
    a, c = _observable(scaled, order)
    eigenvalues, vectors = np.linalg.eig(a)
    if np.any((np.abs(eigenvalues.imag) < 1e-12) & (eigenvalues.real <= 0.0)):
        raise IdentificationError(
            f'subspace identification: {order} states give a pole on the negative real axis; '
            'record more data'
        )
    poles = np.log(eigenvalues.astype(complex)) / dt
    modal = c @ vectors
    b = _inputs(scaled, dt, poles, modal, hold)
    return StateSpace(poles, b / u_scale, y_scale[:, np.newaxis] * modal)


def _observable(experiments: Sequence[Signals], order: int) -> tuple[FloatArray, FloatArray]:
    """Estimate and return state matrix (r, r) and output matrix (p, r) of the sampled system."""
    m, p = experiments[0].u.shape[1], experiments[0].y.shape[1]
    triangle = np.empty((0, 2 * _HORIZON * (m + p)))
    for e in experiments:
        if len(e.u) >= 2 * _HORIZON:
            u, y = _hankel(e.u, 2 * _HORIZON), _hankel(e.y, 2 * _HORIZON)
            block = np.hstack(
                [u[:, m * _HORIZON :], u[:, : m * _HORIZON], y[:, : p * _HORIZON],
                 y[:, p * _HORIZON :]]
            )  # fmt: skip
            triangle = np.asarray(np.linalg.qr(np.vstack([triangle, block]), mode='r'))
    lower = triangle.T
    past = slice(m * _HORIZON, (2 * m + p) * _HORIZON)
    left, sizes, _ = np.linalg.svd(lower[(2 * m + p) * _HORIZON :, past])
    gamma = left[:, :order] * np.sqrt(sizes[:order])
    a = np.linalg.lstsq(gamma[:-p], gamma[p:], rcond=None)[0]
    return a, gamma[:p]


def _hankel(values: FloatArray, rows: int) -> FloatArray:
    """Return the Hankel matrix of `rows` successive samples, (N - rows + 1, rows * columns)."""
    windows = np.lib.stride_tricks.sliding_window_view(values, rows, axis=0)
    return np.asarray(windows.transpose(0, 2, 1).reshape(len(windows), -1))


def _inputs(
    experiments: Sequence[Signals],
    dt: float,
    poles: ComplexArray,
    modal: ComplexArray,
    hold: Sequence[Hold],
) -> ComplexArray:
    """Fit and return the input gains of the modes, (r, m), with free initial states."""
    # The outputs are real, so the input gains of a conjugate pair of poles are conjugate as well.
    normal, right = [], []
    for e in experiments:
        start = _outputs(modal, np.exp(dt * np.outer(np.arange(len(e.u)), poles)))
        table = np.hstack(
            [_outputs(modal, _driven(u, dt, poles, h)) for u, h in zip(e.u.T, hold, strict=True)]
        )
        basis = np.linalg.qr(start)[0]
        table -= basis @ (basis.conj().T @ table)
        normal.append(table.conj().T @ table)
        right.append(table.conj().T @ e.y.ravel())
    solution = np.linalg.solve(np.sum(normal, axis=0), np.sum(right, axis=0))
    return np.asarray(solution.reshape(-1, len(poles)).T)


def _outputs(modal: ComplexArray, states: ComplexArray) -> ComplexArray:
    """Return the output of each mode, (N p, r), for mode states (N, r)."""
    return np.asarray((states[:, np.newaxis] * modal).reshape(-1, modal.shape[1]))


def _driven(u: FloatArray, dt: float, poles: ComplexArray, hold: Hold) -> ComplexArray:
    """Return the states of r modes, (N, r), for an input u, (N,), with unit input gains."""
    states = np.empty((len(u), len(poles)), complex)
    for k, pole in enumerate(poles):
        factor = np.exp(pole * dt)
        gain = (factor - 1.0) / pole
        if hold == 'zero':
            numerator = [0.0, gain]
        else:
            ramp = (gain - dt) / (pole * dt)
            numerator = [ramp, gain - ramp]
        states[:, k] = lfilter(numerator, [1.0, -factor], u.astype(complex))
    return states
