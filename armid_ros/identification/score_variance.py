# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How much wider than in white noise the intervals of recursive estimates have to be.

The covariance of least squares takes every row's error as independent of the next one's. Errors
that last, of coloured noise or of what the model lacks, add up. The scores W^T r of successive
windows, longer than the errors last, are nearly independent; with J the sum of their squares and
M that of the information, the values have the covariance M^-1 J M^-1 in place of M^-1.
Source: Newey and West 1987, with windows in place of lags.

"""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np

#: Windows that the mean of all parameters counts for, beside what each one shows itself.
_SHARED = 8.0
#: Ridge that keeps the information of what was never excited invertible [-].
_RIDGE = 1e-9


class ScoreVariance:
    """
    Sums up the scores of windows.

    Parameters
    ----------
    size : int
        Number of parameters P.

    """

    def __init__(self, size: int) -> None:
        self._information = np.zeros((size, size))
        self._squares = np.zeros((size, size))
        self._count = 0
        self._ratio = np.ones(size)

    def add(self, information: FloatArray, score: FloatArray) -> None:
        """
        Take in a window.

        Parameters
        ----------
        information : ndarray, shape (P, P)
            W^T W of its rows of unit noise.
        score : ndarray, shape (P,)
            W^T r of their residuals.

        """
        self._count += 1
        fitted = 1.0 / (self._count + 1.0)  # the share of a residual that the fit has taken away
        self._information += (1.0 - fitted) * information
        self._squares += np.outer(score, score)
        size = np.sqrt(np.maximum(np.diag(self._information), np.finfo(float).tiny))
        scale = np.outer(size, size)
        inverse = np.linalg.inv(self._information / scale + _RIDGE * np.eye(len(size)))
        variance = np.einsum('ij,jk,ki->i', inverse, self._squares / scale, inverse)
        self._ratio = variance / np.diag(inverse)

    def widening(self, variance: float) -> FloatArray:
        """
        Return the factor of every standard deviation, shape (P,), at least 1.

        Parameters
        ----------
        variance : float
            Of the rows, by which the covariance is multiplied already.

        """
        if not (self._count and variance > 0.0):
            return np.ones(len(self._ratio))
        shared = _SHARED * np.mean(self._ratio) + self._count * self._ratio
        ratio = shared / (_SHARED + self._count) / variance
        return np.asarray(np.sqrt(np.maximum(1.0, ratio)))
