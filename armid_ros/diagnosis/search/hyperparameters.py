# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Standard deviations of model discrepancy and noise, and the nuisance parameters given these."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import linalg

#: Number of correlated rows that count as one independent row, if no baseline measures it.
CORRELATED_ROWS = 2.0


@dataclass(frozen=True)
class Hyperparameters:
    """
    Standard deviations of three errors: of described links, model discrepancy and noise.

    Attributes
    ----------
    body : float
        Standard deviation of the errors of described links, over the largest expected errors;
        zero if all given values are exact. Parameters without given values are always fitted.
    shared, own : float
        Standard deviations of the discrepancy of all recordings (d0) and of one recording (d_k),
        over the amplitude of `Rows`.
    noise : float
        Standard deviation of the noise e_k, over the sigma of `Rows`.
    correlated_rows : float
        Number of correlated rows that count as one independent row.
    prior : float
        Log prior probability.

    """

    body: float
    shared: float
    own: float
    noise: float
    correlated_rows: float
    prior: float = 0.0

    @property
    def precision(self) -> float:
        """Inverse noise variance of a weighted row, reduced for the correlation of rows."""
        return 1.0 / (self.correlated_rows * self.noise**2)


@dataclass(frozen=True)
class MotionDiscrepancies:
    """
    Gaussian posteriors of the model discrepancies d_k of K recordings.

    Attributes
    ----------
    covariance : ndarray, shape (K, n, f, f)
        Covariance of the f coefficients of each joint, given all other parameters.
    aim : ndarray, shape (K, n, f)
        Inner products of their columns with the residual, over the variance of the noise.
    regressed : ndarray, shape (K, n f, u)
        Derivative of their means with respect to the u fitted parameters, with opposite sign.

    """

    covariance: FloatArray
    aim: FloatArray
    regressed: FloatArray


@dataclass(frozen=True)
class NuisancePosterior:
    """
    Gaussian posterior of the nuisance parameters at given hyperparameters.

    Attributes
    ----------
    hyperparameters : Hyperparameters
        The assumed standard deviations of discrepancy and noise.
    used : ndarray of int, shape (u,)
        Indices of the fitted parameters.
    lower : ndarray, shape (u, u)
        Cholesky factor of the precision of the fitted parameters.
    values : ndarray, shape (u,)
        Means of the fitted parameters.
    evidence : float
        Log probability density of the data (log evidence), up to a constant.
    loss : float
        Half of the minimum of the regularised sum of squares.
    motion : MotionDiscrepancies or None
        The discrepancies d_k of the fitted recordings; None if they are zero.

    """

    hyperparameters: Hyperparameters
    used: npt.NDArray[np.intp]
    lower: FloatArray
    values: FloatArray
    evidence: float
    loss: float
    motion: MotionDiscrepancies | None

    @cached_property
    def root(self) -> FloatArray:
        """Return a matrix R (u, u) such that R'R is the posterior covariance."""
        return np.asarray(linalg.solve_triangular(self.lower, np.eye(len(self.lower)), lower=True))
