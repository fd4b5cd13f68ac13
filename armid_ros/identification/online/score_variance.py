# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The covariance of recursive estimates whose errors last.

R^-1 R^-T, the covariance of least squares, takes the error of every row as independent of the
next one's. Errors that last, of coloured noise or of what the model lacks, add up. With the
density phi_jb of the noise of joint j in a band b of frequencies, and the products M_jb = W^H W of
its rows there, the scores W^T r have the covariance J = sum of phi_jb M_jb in place of M = sum of
M_jb, and the values M^-1 J M^-1. Rows are transformed window by window, and their products summed
up, so what is kept does not grow. The torques are among the columns, so the power of the residuals
in a band is that of the present estimate, however wrong it was when the rows came.
Source: Newey and West 1987, with bands of frequencies in place of lags.

"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from armid_ros.identification.fitting.least_squares import LEAST_LEFT
from armid_ros.identification.online.square_root import PRIOR_STD
from armid_ros.motion import FloatArray
import numpy as np
from scipy import linalg, stats

#: Rows over frequencies that are looked at: beyond, the low-pass has left nothing.
_ROWS_OF_BIN = 8
#: Ridge that keeps the information of what was never excited invertible [-].
_RIDGE = 1e-9
#: What is divided by is at least this.
_SMALLEST = 1e-100
#: Least share of the power of the torques that noise has: arithmetic is no better.
_LEAST_NOISE = 1e-20
#: Degrees of freedom of a variance that are taken for granted.
_FEWEST = 3.0
#: Level of the upper end of an interval.
_LEVEL = 0.975


@dataclass(frozen=True, eq=False)
class _Bands:
    """
    Products of rows and torques, joint by joint and band by band.

    Attributes
    ----------
    products : ndarray, shape (m, B, P + 1, P + 1)
        Of the transforms of the columns, torques last.
    counts : ndarray, shape (m, B)
        Real numbers of every column that they are sums over.

    """

    products: FloatArray
    counts: FloatArray

    def __add__(self, other: _Bands) -> _Bands:
        return _Bands(self.products + other.products, self.counts + other.counts)

    @property
    def information(self) -> FloatArray:
        """M of all joints and bands, shape (P, P)."""
        return np.asarray(self.products.sum(axis=(0, 1))[:-1, :-1])


class ScoreVariance:
    """
    Sums up windows of rows, and says what covariance their residuals give an estimate.

    Parameters
    ----------
    window : int
        Rows in a window, which should last longer than errors do.
    forgetting : float
        Share of what was that is not forgotten with a row; no window takes more than it brings.

    """

    def __init__(self, window: int, forgetting: float = 1.0) -> None:
        self._window = window
        self._kept = forgetting**window
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._settled: _Bands | None = None
        self._latest: _Bands | None = None
        self._shape: tuple[FloatArray, FloatArray] | None = None
        self.interrupt()

    def interrupt(self) -> None:
        """Begin a new stretch of rows, which does not continue the one before."""
        self._rows: list[FloatArray] = []

    def add(self, rows: FloatArray, tau: FloatArray, values: FloatArray) -> None:
        """
        Take in one sample.

        Parameters
        ----------
        rows, tau : ndarray, shapes (m, P) and (m,)
            Rows and torques in units of the assumed noise; zero where not used.
        values : ndarray, shape (P,)
            The estimate that residuals are taken of, at the end of a window.

        """
        self._rows.append(np.concatenate([rows, tau[:, np.newaxis]], axis=1))
        if len(self._rows) < self._window:
            return
        window = _transformed(np.stack(self._rows))
        self.interrupt()
        if not window.counts.any():
            return
        if self._latest is not None:
            self._settled = _sum(self._settled, self._latest)
            kept = max(self._kept, 1.0 - _brought(window, self._settled))
            self._settled = _Bands(self._settled.products * kept, self._settled.counts * kept)
            self._shape = _shape(self._settled + window, values)
        self._latest = window

    def reopen(self, directions: FloatArray, values: FloatArray) -> None:
        """
        Let the parameters have been others before, by something that is not known.

        The last window, in which they may have changed, is left out. From the torques of all rows
        before is subtracted what the change adds to them if it is the one for which they fit best.

        Parameters
        ----------
        directions : ndarray, shape (P, k)
            What the change may have added.
        values : ndarray, shape (P,)
            The estimate now.

        """
        self.interrupt()
        self._latest = self._shape = None
        if self._settled is None:
            return
        products, size = self._settled.products, len(values)
        both = products.sum(axis=(0, 1))[:size]
        directions = directions / np.sqrt(
            np.einsum('pk,pq,qk->k', directions, both[:, :size], directions).clip(_SMALLEST)
        )
        along = linalg.pinvh(directions.T @ both[:, :size] @ directions) @ directions.T @ both
        change = np.eye(size + 1)
        change[:size] -= (1.0 - np.sqrt(_RIDGE)) * directions @ along
        moved = change.T @ products @ change
        self._settled = _Bands(moved, self._settled.counts)
        self._shape = _shape(self._settled, values)

    def covariance(self, root: FloatArray) -> FloatArray | None:
        """
        Return the covariance of an estimate, shape (P, P); None before the second window.

        Few windows tell the noise only roughly: its deviations are those of normal distributions
        with intervals as wide as Student's.

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


def _sum(some: _Bands | None, more: _Bands) -> _Bands:
    return more if some is None else some + more


def _brought(window: _Bands, before: _Bands) -> float:
    """Return the share of what is known with a window that it brings, mean of all directions."""
    both = before.information + window.information
    size = np.sqrt(np.diag(both).clip(PRIOR_STD**-2))
    scale = np.outer(size, size)
    share = np.linalg.solve(both / scale + _RIDGE * np.eye(len(size)), window.information / scale)
    return float(np.trace(share)) / len(size)


def _transformed(columns: FloatArray) -> _Bands:
    """Return the products of a window of rows [W, y] of shape (k, m, P + 1), in octaves."""
    count, joints, size = columns.shape
    transformed = np.fft.rfft(columns, axis=0)[: max(2, count // _ROWS_OF_BIN)]
    transformed *= np.sqrt(2.0 / count)
    transformed[0] *= np.sqrt(0.5)
    edges = [0, *(2 ** np.arange(1, (len(transformed) - 1).bit_length())), len(transformed)]
    used = np.mean(columns.any(axis=2), axis=0)
    products = np.zeros((joints, len(edges) - 1, size, size))
    counts = np.zeros((joints, len(edges) - 1))
    for band, (first, last) in enumerate(pairwise(edges)):
        part = transformed[first:last].transpose(1, 0, 2)
        parts = np.concatenate([part.real, part.imag], axis=1)
        products[:, band] = parts.transpose(0, 2, 1) @ parts
        counts[:, band] = used * (2 * (last - first) - (first == 0))
    return _Bands(products, counts)


def _shape(bands: _Bands, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return a root of R_M^-T J R_M^-1, R_M that of M, and what widens deviations by it.

    The noise is what residuals have in a band over what the fit has left of it there; the
    covariance of every value is a sum over bands, and as certain as that (Satterthwaite 1946).

    """
    information, scores = bands.information, bands.products[..., :-1, :-1]
    size = np.sqrt(np.diag(information).clip(PRIOR_STD**-2))
    ridge = _RIDGE * np.eye(len(size))
    inverse = linalg.solve_triangular(
        _triangle(information / np.outer(size, size) + ridge), np.eye(len(size))
    )
    root = inverse / size[:, np.newaxis]
    covariance = root @ root.T

    counts = bands.counts.clip(_SMALLEST)
    taken = np.einsum('pq,jbpq->jb', covariance, scores)
    freedom = counts * (1.0 - taken / counts).clip(LEAST_LEFT)
    ends = np.append(values, -1.0)
    power = np.einsum('p,jbpq,q->jb', ends, bands.products, ends, optimize=True)
    noise = np.maximum(power, _LEAST_NOISE * bands.products[..., -1, -1]) / freedom

    usual = float(np.sum(noise * taken) / np.sum(taken))
    meat = (
        root.T @ np.tensordot(noise, scores, axes=2) @ root + usual * inverse.T @ ridge @ inverse
    )
    sizes, vectors = np.linalg.eigh(meat)
    half = vectors * np.sqrt(np.maximum(sizes, _RIDGE * sizes[-1]))

    shares = np.einsum('pq,jbqp->jbp', covariance, scores @ covariance, optimize=True)
    shares *= noise[..., np.newaxis]
    uncertain = np.sum(shares**2 / freedom[..., np.newaxis], axis=(0, 1))
    known = np.sum(shares, axis=(0, 1)) ** 2 / uncertain.clip(_SMALLEST)
    student = stats.t.ppf(_LEVEL, np.maximum(known, _FEWEST))
    return half, student / stats.norm.ppf(_LEVEL)


def _triangle(information: FloatArray) -> FloatArray:
    """Return the upper triangle R with R^T R as given, its diagonal positive."""
    sizes, vectors = np.linalg.eigh(information)
    root = np.linalg.qr(np.sqrt(sizes.clip(_RIDGE))[:, np.newaxis] * vectors.T, mode='r')
    return np.asarray(np.where(np.diag(root) < 0.0, -1.0, 1.0)[:, np.newaxis] * root)
