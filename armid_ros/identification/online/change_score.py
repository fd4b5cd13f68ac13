# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Likelihood ratio of a change in a window of rows, given the estimate before the window.

The estimate before a window is theta0, with the information A = R^T R. The rows W of the window,
of unit noise, give M = W^T W and c = W^T tau. The hypothesis theta = theta0 + D delta in the
window, with theta0 as uncertain as before, has

    S = D^T A (A + M)^-1 M D    and    s = D^T A (A + M)^-1 (c - M theta0)

as information on delta and its score. The estimate of delta is S^-1 s, and s^T S^-1 s is twice
the logarithm of the likelihood ratio. A change is not detectable where A D is zero.
Source: Willsky and Jones 1976, the generalised likelihood ratio test.

This statistic is chi-square of p degrees only if noise is white and the model right. Its actual
null distribution is measured while nothing changes (``null_calibration``).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.changes.statistic import quadratic_form
from armid_ros.identification.online.background import Pieces
from armid_ros.identification.online.recursive import Learned, WeightedSample
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy.linalg import lapack

#: Eigenvalues of an information matrix below this share of the largest count as zero [-].
_NOTHING = 1e-9
#: Share of a change that the data do not determine, above which its variance is infinite [-].
_HIDDEN = 1e-6


@dataclass(frozen=True, eq=False)
class Block:
    """
    Normal equations of a short stretch of whitened rows.

    Attributes
    ----------
    begin, end : float
        First and last time of the stretch [s].
    information : ndarray, shape (P, P)
        M = W^T W.
    right : ndarray, shape (P,)
        c = W^T tau.
    moved : ndarray, shape (P, Q)
        M D, with the directions D of all candidate changes.
    known : ndarray, shape (P, P)
        Information before the stretch, A = R^T R.
    known_along : ndarray, shape (P, Q)
        A D, with the same D.
    before : Learned
        State of the estimator with nuisance parameters at the begin.
    narrow : Learned
        State of the estimator without nuisance parameters at the begin.
    samples : tuple of WeightedSample
        Samples of the stretch, kept to be learned again.

    """

    begin: float
    end: float
    information: FloatArray
    right: FloatArray
    moved: FloatArray
    known: FloatArray
    known_along: FloatArray
    before: Learned
    narrow: Learned
    samples: tuple[WeightedSample, ...]


@dataclass(frozen=True, eq=False)
class ScoreStatistics:
    """
    Test statistics of Q candidate changes in a window.

    Attributes
    ----------
    information : ndarray, shape (Q, Q)
        Information S on the changes.
    score : ndarray, shape (Q,)
        Score s of the changes.
    strength : ndarray, shape (Q,)
        Sum of squared torques in the window per unit of each change.

    """

    information: FloatArray
    score: FloatArray
    strength: FloatArray

    def ratios(self, sets: npt.NDArray[np.intp]) -> FloatArray:
        """Return twice the log likelihood ratio of G sets of p changes, (G, p): (G,)."""
        information = self.information[sets[:, :, np.newaxis], sets[:, np.newaxis, :]]
        return quadratic_form(self.score[sets], information, _NOTHING)[0]

    def size(self, some: slice) -> tuple[FloatArray, FloatArray]:
        """
        Return the estimate of some changes and its covariance in white noise.

        The variance of a change is infinite where the window does not determine it by itself.

        """
        information = self.information[some, some]
        covariance = np.linalg.pinv(information, hermitian=True)
        values = np.asarray(covariance @ self.score[some])
        shown = np.einsum('pq,qp->p', covariance, information)  # 1 for a change that is determined
        hidden = np.flatnonzero(shown < 1.0 - _HIDDEN)
        covariance[hidden, hidden] = np.inf
        return values, np.asarray(covariance)


def weighing(
    window: Sequence[Block],
    before: Block,
    directions: FloatArray,
    residual_scale: float = 1.0,
) -> Pieces[ScoreStatistics]:
    """
    Compute the statistics of candidates in a window, in pieces.

    Parameters
    ----------
    window : sequence of Block
        Blocks of the window.
    before : Block
        Block whose initial state is compared with the window.
    directions : ndarray, shape (P, Q)
        Change of the parameters per unit of each candidate quantity.
    residual_scale : float
        Noise of the rows over the noise that the earlier information assumes.

    """
    first = window[0]
    information, right, moved = first.information, first.right, first.moved
    for one in window[1:]:
        information = information + one.information
        right, moved = right + one.right, moved + one.moved
    yield
    both = before.known / residual_scale**2 + information
    scale = 1.0 / np.sqrt(np.diag(both))
    both *= scale * scale[:, np.newaxis]
    np.fill_diagonal(both, 1.0 + _NOTHING)
    yield
    factor, _ = lapack.dpotrf(both, lower=1, clean=0)
    score = right - information @ before.before.values
    scaled = np.asfortranarray(np.column_stack([moved, score]) * scale[:, np.newaxis])
    yield
    solved, _ = lapack.dpotrs(factor, scaled, lower=1, overwrite_b=1)
    yield
    along = scale[:, np.newaxis] * before.known_along / residual_scale**2
    shared = along.T @ solved
    strength = np.einsum('pq,pq->q', directions, moved)
    return ScoreStatistics((shared[:, :-1] + shared[:, :-1].T) / 2.0, shared[:, -1], strength)
