# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Amplitudes of discrepancy and noise, and the nuisance parameters that they give."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: Rows of one independent row without a baseline.
LASTING = 2.0


@dataclass(frozen=True)
class Setting:
    """
    Whether the body is free, and the amplitudes of discrepancy and noise.

    Attributes
    ----------
    free : bool
        Whether the body is fitted anew; what has no given values always is.
    shared, own : float
        Standard deviations of d0 and d_k.
    noise : float
        That of e_k, over the unit of the rows.
    lasting : float
        Rows that make one independent row.
    prior : float
        Log prior probability.

    """

    free: bool
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
    The nuisance parameters under one setting.

    Attributes
    ----------
    setting : Setting
        The setting.
    used : ndarray of int, shape (u,)
        Which parameters are fitted.
    root : ndarray, shape (u, u)
        R of their covariance R'R.
    values : ndarray, shape (u,)
        Their means.
    evidence : float
        Log evidence.
    loss : float
        Half of the weighted squares that are left.
    motions : mapping of int to MotionDiscrepancy
        The discrepancy of each recording.

    """

    setting: Setting
    used: npt.NDArray[np.intp]
    root: FloatArray
    values: FloatArray
    evidence: float
    loss: float
    motions: dict[int, MotionDiscrepancy]
