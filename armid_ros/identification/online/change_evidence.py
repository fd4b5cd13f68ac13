# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The likelihood ratio of a change, against what was known before and what noise usually does.

What was known before a window is theta0 with the information A = R^T R. The rows W of the window,
of unit noise, give M = W^T W and c = W^T tau. That theta = theta0 + D delta from then on, theta0
being as uncertain as it was, is said by

    S = D^T A (A + M)^-1 M D    and    s = D^T A (A + M)^-1 (c - M theta0)

as information on delta and its score: the estimate is S^-1 s, and s^T S^-1 s twice the logarithm
of the likelihood ratio. What was not known before, where A D is nothing, cannot be seen to change.
Source: Willsky and Jones 1976, the generalised likelihood ratio test.

Twice the logarithm is chi-square of p degrees only if noise is white and the model right; how
large it is otherwise is measured while nothing changes (``usual_size``).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.identification.online.recursive import Learned
from armid_ros.motion import FloatArray
import numpy as np
from scipy import linalg

#: Eigenvalues of an information below this share of the largest are nothing [-].
_NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class Block:
    """
    A short stretch of rows of unit noise, summed up.

    Attributes
    ----------
    begin, end : float
        From when to when [s].
    information : ndarray, shape (P, P)
        M = W^T W.
    right : ndarray, shape (P,)
        c = W^T tau.
    before : Learned
        What was known when it began.
    asked : Learned
        What the estimator that is asked for its parameters knew then.
    samples : tuple of (rows, tau, weights)
        What it was made of, to learn from it once more.

    """

    begin: float
    end: float
    information: FloatArray
    right: FloatArray
    before: Learned
    asked: Learned
    samples: tuple[tuple[FloatArray, FloatArray, FloatArray], ...]


@dataclass(frozen=True, eq=False)
class Evidence:
    """
    What a window says of Q possible changes.

    Attributes
    ----------
    information : ndarray, shape (Q, Q)
        S.
    score : ndarray, shape (Q,)
        s.
    strength : ndarray, shape (Q,)
        Squares of the torques in the window that a unit of each change would make.

    """

    information: FloatArray
    score: FloatArray
    strength: FloatArray

    def ratio(self, some: slice) -> float:
        """Return twice the logarithm of the likelihood ratio of some changes at once."""
        if some.stop - some.start == 1:
            information, score = self.information[some.start, some.start], self.score[some.start]
            return float(score**2 / information) if information > 0.0 else 0.0
        size, vectors = np.linalg.eigh(self.information[some, some])
        kept = size > _NOTHING * max(size[-1], 0.0)
        return float(np.sum((vectors.T @ self.score[some])[kept] ** 2 / size[kept]))

    def size(self, some: slice) -> tuple[FloatArray, FloatArray]:
        """Return the estimate of some changes and its covariance in white noise."""
        covariance = np.linalg.pinv(self.information[some, some], hermitian=True)
        return np.asarray(covariance @ self.score[some]), np.asarray(covariance)


def evidence(
    blocks: Sequence[Block], before: Learned, directions: FloatArray, loudness: float = 1.0
) -> Evidence:
    """
    Weigh possible changes by a window of rows.

    Parameters
    ----------
    blocks : sequence of Block
        The window.
    before : Learned
        What was known before it.
    directions : ndarray, shape (P, Q)
        What the changes do to the parameters.
    loudness : float
        Noise of what was learned before, in the unit of the window's.

    """
    information = np.sum([block.information for block in blocks], axis=0)
    right = np.sum([block.right for block in blocks], axis=0)
    known = before.root.T @ before.root / loudness**2
    scale = 1.0 / np.sqrt(np.diag(known) + np.diag(information))
    both = scale[:, np.newaxis] * (known + information) * scale + _NOTHING * np.eye(len(scale))
    factor = linalg.cho_factor(both, check_finite=False)
    moved = np.column_stack([information @ directions, right - information @ before.values])
    solved = linalg.cho_solve(factor, scale[:, np.newaxis] * moved, check_finite=False)
    shared = (known @ directions).T @ (scale[:, np.newaxis] * solved)
    strength = np.sum(directions * moved[:, :-1], axis=0)
    return Evidence((shared[:, :-1] + shared[:, :-1].T) / 2.0, shared[:, -1], strength)
