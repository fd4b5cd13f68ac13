# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Amplitudes of discrepancy and noise, and the fit of the nuisance parameters for each."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Number of correlated rows that equal one independent row, without a baseline.
LASTING = 2.0


@dataclass(frozen=True)
class Setting:
    """
    Amplitudes of the errors of the body, of discrepancy and of noise.

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
    """The marginalised discrepancy d_k of one recording; see `Nuisance.marginal`."""

    inverse: FloatArray
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
    root : ndarray, shape (u, u)
        Matrix R of the covariance R'R of the fitted parameters.
    values : ndarray, shape (u,)
        Means of the fitted parameters.
    evidence : float
        Log evidence.
    loss : float
        Half of the remaining weighted squares.
    motions : mapping of int to MotionDiscrepancy
        The marginalised discrepancy d_k of each recording.

    """

    setting: Setting
    used: npt.NDArray[np.intp]
    root: FloatArray
    values: FloatArray
    evidence: float
    loss: float
    motions: dict[int, MotionDiscrepancy]
