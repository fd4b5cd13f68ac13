# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From bags to estimates: sums of normal equations, a fit, and its standard deviations.

Standard deviations follow from the spectrum of the residuals, which normal equations do not
contain. A second pass over the bags therefore computes the noise products at the estimate of the
arm. Noise products add up over bags, so the result equals one identification of all bags.

"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from armid_ros.estimate import ParameterName
from armid_ros.fleet.bags import BagFile
from armid_ros.fleet.job import Job
from armid_ros.identification.fitting.covariance import noise_products, sandwich
from armid_ros.identification.fitting.excited import bounds, identifiable_base
from armid_ros.identification.fitting.normal_equations import (
    NormalEquations,
    weighted_fit,
    WeightedFit,
)
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Refused:
    """
    A bag that is not used.

    Attributes
    ----------
    bag : BagFile
        The bag.
    reason : str
        Why the bag is not used, and the remedy.
    failed : bool
        Whether a store or a worker failed repeatedly, so the bag itself may be good.

    """

    bag: BagFile
    reason: str
    failed: bool = False

    def merged(self) -> MergedBags:
        """Return a group that consists of this bag."""
        return MergedBags(refused=(self,))


@dataclass(frozen=True, eq=False)
class FleetEstimate:
    """
    The estimate from one bag, or from all bags of an arm.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Base parameters and parameters of the effects.
    values, std : ndarray, shape (r,)
        Values and standard deviations.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of each joint [N m].
    relative_error_percent : float
        100 |tau - tau_hat| / |tau| over all joints and rows.
    condition_number : float
        Condition number of the weighted regressor.

    """

    parameters: tuple[ParameterName, ...]
    values: FloatArray
    std: FloatArray
    joint_std: FloatArray
    relative_error_percent: float
    condition_number: float


@dataclass(frozen=True, eq=False)
class FleetFit:
    """
    A fit of the parameters, before its standard deviations are known.

    Attributes
    ----------
    base : BaseParameters
        The identifiable parameters.
    kept : sequence of int
        Columns of the theoretically identifiable parameters that the data identify.
    fit : WeightedFit
        The weighted fit of these columns.

    """

    base: BaseParameters
    kept: Sequence[int]
    fit: WeightedFit

    @classmethod
    def of(cls, normal: NormalEquations, job: Job) -> FleetFit | None:
        """Fit normal equations; return None if there are too few rows."""
        base, kept = identifiable_base(job.theory, normal)
        if normal.counts.sum() < 2 * base.rank:
            return None
        limits = bounds(job.arm, base)
        fit = weighted_fit(normal.restrict(kept), weighted=job.settings.weighted, bounds=limits)
        return cls(base, tuple(kept), fit)

    def noise(self, rows: Iterable[Regression]) -> FloatArray:
        """Return the covariance of the products of columns and residuals of rows, (r, r)."""
        products = np.zeros((len(self.kept), len(self.kept)))
        for part in rows:
            some = part if len(self.kept) == part.columns.shape[2] else part.restrict(self.kept)
            weights = some.informative / self.fit.scale
            residual = some.tau - some.columns @ self.fit.values
            products += noise_products([some], residual * weights, weights, self.fit.inverse)
        return products

    def estimate(self, normal: NormalEquations, noise: FloatArray) -> FleetEstimate:
        """Return the estimate, given the noise products of the same rows."""
        some = normal.restrict(self.kept)
        squares = some.squares(self.fit.values).sum() / some.target_squares.sum()
        return FleetEstimate(
            self.base.parameters,
            self.fit.values,
            np.sqrt(np.diag(sandwich(self.fit.bread, noise))),
            some.joint_std(self.fit.values),
            float(100.0 * np.sqrt(squares)),
            self.fit.condition_number,
        )


@dataclass(frozen=True, eq=False)
class MergedBags:
    """
    Merged bags of one arm.

    Attributes
    ----------
    normal : NormalEquations or None
        Normal equations of all rows; None if all bags were refused.
    seconds : float
        Total time of motion [s].
    versions : tuple of (str, str)
        URL and version of every bag.
    found : int
        Number of bags that an earlier run had read.
    refused : tuple of Refused
        Bags that are not used.

    """

    normal: NormalEquations | None = None
    seconds: float = 0.0
    versions: tuple[tuple[str, str], ...] = ()
    found: int = 0
    refused: tuple[Refused, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[MergedBags]) -> MergedBags:
        """Merge several groups of bags, in order."""
        known = [part.normal for part in parts if part.normal is not None]
        return cls(
            sum(known[1:], known[0]) if known else None,
            sum(part.seconds for part in parts),
            tuple(version for part in parts for version in part.versions),
            sum(part.found for part in parts),
            tuple(refused for part in parts for refused in part.refused),
        )
