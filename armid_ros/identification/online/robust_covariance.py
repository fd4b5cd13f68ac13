# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Covariance of recursive estimates with autocorrelated errors.

The covariance of least squares, R^-1 R^-T, takes errors of different rows as independent. Errors
of coloured noise or of model discrepancy are autocorrelated and add up. Let phi_jb be the noise
density of joint j in frequency band b, and M_jb = W^H W the products of its rows there. The scores
W^T r have the covariance J = sum of phi_jb M_jb in place of M = sum of M_jb, and the values have
M^-1 J M^-1. Rows are transformed window by window, and their products are summed, so the memory
does not grow. The torque is one of the columns. The residual power in a band is therefore always
that of the present estimate, not of earlier ones.
Source: Newey and West 1987, with bands of frequencies in place of lags.

"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from armid_ros.identification.fitting.covariance import MIN_RESIDUAL_SHARE
from armid_ros.identification.online.background import Background, Job, Pieces
from armid_ros.identification.online.recursive import PRIOR_STD, WeightedSample
from armid_ros.motion import FloatArray
import numpy as np
from scipy import linalg, stats

#: Ridge that keeps the information invertible in directions that were never excited [-].
_RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class _Bands:
    """Products of Fourier transforms of regressor and torque, by joint and frequency band."""

    products: FloatArray  # (m, B, P + 1, P + 1), torques last
    counts: FloatArray  # number of real values summed up in every product, (m, B)

    @property
    def information(self) -> FloatArray:
        """Return the information matrix M, summed over joints and bands, shape (P, P)."""
        return np.asarray(self.products.sum(axis=(0, 1))[:-1, :-1])


class RobustCovariance:
    """
    Covariance of a recursive estimate whose errors are autocorrelated.

    Parameters
    ----------
    window : int
        Samples in a window, which should be longer than the correlation time of errors.
    forgetting : float
        Forgetting factor per sample; a window removes no more information than it adds.
    work : Background
        Queue of the computations on complete windows.

    """

    def __init__(self, window: int, forgetting: float, work: Background) -> None:
        self._window = window
        self.forgetting = forgetting
        self._work = work
        self._settled: _Bands | None = None
        self._latest: _Bands | None = None
        self._shape: tuple[FloatArray, FloatArray] | None = None
        self.interrupt()

    def interrupt(self) -> None:
        """Start a new window after an interruption of the stream."""
        self._rows: FloatArray | None = None
        self._count = 0

    def add(self, sample: WeightedSample, scale: FloatArray, values: FloatArray) -> None:
        """
        Add one sample to the present window.

        Parameters
        ----------
        sample : WeightedSample
            Rows and torques.
        scale : ndarray, shape (m,)
            Factors that scale the rows to unit noise; zero where not used.
        values : ndarray, shape (P,)
            Estimate for the residuals of the window, used if this sample ends a window.

        """
        if self._rows is None:
            self._rows = np.empty((self._window, len(scale), len(values) + 1))
        row = self._rows[self._count]
        np.multiply(sample.rows, scale[:, np.newaxis], out=row[:, :-1])
        np.multiply(sample.tau, scale, out=row[:, -1])
        self._count += 1
        if self._count == self._window:
            self._work.begin(self._add_window(self._rows.swapaxes(0, 1), values))
            self.interrupt()

    def allow_change(self, directions: FloatArray, values: FloatArray) -> None:
        """
        Allow for a change of the parameters between earlier and later samples.

        The last window, in which they may have changed, is left out. The torque of the change that
        fits best is subtracted from the torques of all earlier samples.

        Parameters
        ----------
        directions : ndarray, shape (P, k)
            Directions in which the parameters may have changed.
        values : ndarray, shape (P,)
            The present estimate.

        """
        self.interrupt()
        self._shape = None
        self._work.begin(self._subtract_change(directions, values))

    def _add_window(self, columns: FloatArray, values: FloatArray) -> Job:
        """Add the Fourier products of a window of regressors and torques, (m, k, P + 1)."""
        window = yield from _transformed(columns)
        if not window.counts.any():
            return
        if self._latest is not None:
            settled = self._latest
            if self._settled is not None:
                settled = yield from _sum(self._settled, self._latest)
            # share of the information that the window adds, mean over all directions
            both = settled.information + window.information
            size = np.sqrt(np.diag(both).clip(PRIOR_STD**-2))
            scale, ridge = np.outer(size, size), _RIDGE * np.eye(len(size))
            share = np.linalg.solve(both / scale + ridge, window.information / scale)
            added = float(np.trace(share)) / len(size)
            kept = max(self.forgetting**self._window, 1.0 - added)
            yield
            if kept < 1.0:
                for products in settled.products:
                    products *= kept
                    yield
                settled.counts[:] *= kept
            self._settled = settled
            every = yield from _sum(settled, window)
            self._shape = yield from _score_root(every, values)
        self._latest = window

    def _subtract_change(self, directions: FloatArray, values: FloatArray) -> Job:
        """Fit a parameter change along `directions`; subtract it from earlier products."""
        self._latest = None
        if self._settled is None:
            return
        products, size = self._settled.products, len(values)
        both = products.sum(axis=(0, 1))[:size]
        directions = directions / np.sqrt(
            np.einsum('pk,pq,qk->k', directions, both[:, :size], directions).clip(1e-100)
        )
        along = linalg.pinvh(directions.T @ both[:, :size] @ directions) @ directions.T @ both
        change = np.eye(size + 1)
        change[:size] -= (1.0 - np.sqrt(_RIDGE)) * directions @ along
        yield
        for of_joint in products:
            for of_band in of_joint:
                of_band[:] = change.T @ of_band @ change
                yield
        self._shape = yield from _score_root(self._settled, values)

    def covariance(self, root: FloatArray) -> FloatArray | None:
        """
        Return the covariance (P, P) of an estimate; None before the second window.

        Few windows determine the noise only roughly. The standard deviations are increased so
        that normal intervals are as wide as Student's.

        Parameters
        ----------
        root : ndarray, shape (P, P)
            Upper triangle R of the estimate; its information is R^T R.

        """
        if self._shape is None:
            return None
        half, widening = self._shape
        positive = np.where(np.diag(root) < 0.0, -1.0, 1.0)
        half = linalg.solve_triangular(root, positive[:, np.newaxis] * half)
        half = widening[:, np.newaxis] * half
        return np.asarray(half @ half.T)


def _sum(left: _Bands, right: _Bands) -> Pieces[_Bands]:
    """Return the sum of two sets of Fourier products, computed in short pieces of work."""
    products = np.empty_like(left.products)
    for place, first, second in zip(products, left.products, right.products, strict=True):
        np.add(first, second, out=place)
        yield
    return _Bands(products, left.counts + right.counts)


def _transformed(columns: FloatArray) -> Pieces[_Bands]:
    """Return Fourier products by octave from a window of rows and torques, (m, k, P + 1)."""
    # number of columns transformed in one piece of work
    at_once = 24
    joints, count, size = columns.shape
    # the low-pass filter stops all frequencies above one per 8 rows
    bins = max(2, count // 8)
    edges = [0, *(2 ** np.arange(1, (bins - 1).bit_length())), bins]
    products = np.zeros((joints, len(edges) - 1, size, size))
    counts = np.zeros((joints, len(edges) - 1))
    for joint, rows in enumerate(columns):
        parts = []
        for first in range(0, size, at_once):
            parts.append(np.fft.rfft(rows[:, first : first + at_once], axis=0)[:bins])
            yield
        transformed = np.concatenate(parts, axis=1) * np.sqrt(2.0 / count)
        transformed[0] *= np.sqrt(0.5)
        used = np.mean(rows.any(axis=1))
        yield
        for band, (first, last) in enumerate(pairwise(edges)):
            part = transformed[first:last]
            both = np.concatenate([part.real, part.imag])
            products[joint, band] = both.T @ both
            counts[joint, band] = used * (2 * (last - first) - (first == 0))
            yield
    return _Bands(products, counts)


def _score_root(bands: _Bands, values: FloatArray) -> Pieces[tuple[FloatArray, FloatArray]]:
    """Return a root of the covariance of scores, and factors for intervals by Student's t."""
    # level of the upper end of an interval
    level = 0.975
    # The noise power in a band is that of the residuals, corrected for the degrees of freedom of
    # the fit. The variance of a value is a sum over bands, with degrees by Satterthwaite (1946).
    information, scores = bands.information, bands.products[..., :-1, :-1]
    size = np.sqrt(np.diag(information).clip(PRIOR_STD**-2))
    ridge = _RIDGE * np.eye(len(size))
    yield
    triangle = _triangle(information / np.outer(size, size) + ridge)
    inverse = linalg.solve_triangular(triangle, np.eye(len(size)))
    root = inverse / size[:, np.newaxis]
    covariance = root @ root.T
    yield
    # degrees of freedom of the fit, and squares of its residuals, each (m, B)
    ends, parts = np.append(values, -1.0), []
    for products in bands.products:
        absorbed = np.tensordot(products[:, :-1, :-1], covariance, axes=2)
        parts.append((absorbed, products @ ends @ ends))
        yield
    taken, power = (np.array(part) for part in zip(*parts, strict=True))
    counts = bands.counts.clip(1e-100)
    freedom = counts * (1.0 - taken / counts).clip(MIN_RESIDUAL_SHARE)
    # noise below this share of the torque power is a rounding error
    noise = np.maximum(power, 1e-20 * bands.products[..., -1, -1]) / freedom

    usual = float(np.sum(noise * taken) / np.sum(taken))
    meat = usual * inverse.T @ ridge @ inverse
    for of_joint, products in zip(noise, scores, strict=True):
        meat += root.T @ np.tensordot(of_joint, products, axes=1) @ root
        yield
    sizes, vectors = np.linalg.eigh(meat)
    half = vectors * np.sqrt(np.maximum(sizes, _RIDGE * sizes[-1]))
    yield
    all_shares, uncertain = np.zeros(len(size)), np.zeros(len(size))
    for joint, band in np.ndindex(*noise.shape):
        shares = noise[joint, band] * np.sum(
            covariance * (scores[joint, band] @ covariance).T, axis=1
        )
        all_shares += shares
        uncertain += shares**2 / freedom[joint, band]
        yield
    known = all_shares**2 / uncertain.clip(1e-100)
    student = stats.t.ppf(level, np.maximum(known, 3.0))  # at least 3 degrees of freedom
    return half, student / stats.norm.ppf(level)


def _triangle(information: FloatArray) -> FloatArray:
    """Return triangular R with R^T R = `information`, after raising small eigenvalues."""
    try:
        return np.asarray(linalg.cholesky(information))
    except linalg.LinAlgError:
        sizes, vectors = np.linalg.eigh(information)
        root = np.sqrt(sizes.clip(_RIDGE))[:, np.newaxis] * vectors.T
        triangle = np.linalg.qr(root, mode='r')
        return np.asarray(np.where(np.diag(triangle) < 0.0, -1.0, 1.0)[:, np.newaxis] * triangle)
