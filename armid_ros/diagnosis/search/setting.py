# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Amplitudes of discrepancy and noise, and the fit of the nuisance parameters for each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import linalg

#: Number of correlated rows that equal one independent row, without a baseline.
LASTING = 2.0


@dataclass(frozen=True)
class Setting:
    """
    Sizes that are assumed for errors of the rigid body, for discrepancy and for noise.

    Attributes
    ----------
    body : float
        Standard deviation of the errors of described links, over the largest expected errors;
        zero if all given values are exact. Parameters without given values are always fitted.
    shared, own : float
        Standard deviations of d0 and d_k, over their unit.
    noise : float
        Standard deviation of e_k, over the unit of the rows.
    lasting : float
        Number of correlated rows that count as one independent row.
    prior : float
        Log prior probability.

    """

    body: float
    shared: float
    own: float
    noise: float
    lasting: float
    prior: float = 0.0

    @property
    def precision(self) -> float:
        """Precision of a row, 1 / variance, divided by `lasting` as rows are correlated."""
        return 1.0 / (self.lasting * self.noise**2)


@dataclass(frozen=True)
class MotionDiscrepancy:
    """
    The discrepancies d_k of K recordings, which are integrated out.

    Attributes
    ----------
    covariance : ndarray, shape (K, n, f, f)
        Their covariance, given all other parameters.
    aim : ndarray, shape (K, n, f)
        Products of their columns with the residual, over the variance of the noise.
    regressed : ndarray, shape (K, n f, u)
        Regression of their values on the fitted parameters.

    """

    covariance: FloatArray
    aim: FloatArray
    regressed: FloatArray


@dataclass(frozen=True)
class Marginal:
    """
    Posterior of the nuisance parameters under one setting.

    Attributes
    ----------
    setting : Setting
        The setting.
    used : ndarray of int, shape (u,)
        Indices of the fitted parameters.
    lower : ndarray, shape (u, u)
        Cholesky factor of the precision of the fitted parameters.
    values : ndarray, shape (u,)
        Means of the fitted parameters.
    evidence : float
        Log evidence.
    loss : float
        Half of the remaining weighted squares.
    motion : MotionDiscrepancy or None
        The discrepancies d_k of the fitted recordings; None if they are zero.

    """

    setting: Setting
    used: npt.NDArray[np.intp]
    lower: FloatArray
    values: FloatArray
    evidence: float
    loss: float
    motion: MotionDiscrepancy | None

    @cached_property
    def root(self) -> FloatArray:
        """Return the matrix R of the covariance R'R of the fitted parameters, (u, u)."""
        return np.asarray(linalg.solve_triangular(self.lower, np.eye(len(self.lower)), lower=True))
