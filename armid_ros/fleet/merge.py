# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From bags to estimates: normal equations added up, a fit, and its deviations.

The deviations of a fit come from the spectrum of its residuals, which no summary of fixed size
has; so bags are read a second time, for the noise products at the values of their arm. These add
up over bags, and what comes out is that of one identification of all bags.

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
        Which one.
    reason : str
        Why, and what to do.
    failed : bool
        Whether it was not the bag's fault: a store, or a worker, that was lost too often.

    """

    bag: BagFile
    reason: str
    failed: bool = False

    def merged(self) -> MergedBags:
        """Return it as a group of one bag."""
        return MergedBags(refused=(self,))


@dataclass(frozen=True, eq=False)
class FleetEstimate:
    """
    The estimate of a bag by itself, or of all bags of an arm together.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Base parameters and those of the effects.
    values, std : ndarray, shape (r,)
        Values and standard deviations.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of each joint [N m].
    relative_error_percent : float
        100 |tau - tau_hat| / |tau| over all joints and rows.
    condition_number : float
        Of the weighted regressor.

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
    The values that fit rows, before their deviations.

    Attributes
    ----------
    base : BaseParameters
        The identifiable parameters.
    kept : sequence of int
        Columns of the theory that they keep.
    fit : WeightedFit
        The fit in these.

    """

    base: BaseParameters
    kept: Sequence[int]
    fit: WeightedFit

    @classmethod
    def of(cls, normal: NormalEquations, job: Job) -> FleetFit | None:
        """Fit normal equations; None where there are too few rows."""
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
    Bags of one arm, merged.

    Attributes
    ----------
    normal : NormalEquations or None
        Of all their rows; None if all were refused.
    seconds : float
        Motion in them [s].
    versions : tuple of (str, str)
        URL and version of every bag.
    found : int
        Bags that an earlier run had read.
    refused : tuple of Refused
        Bags that are not among them.

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
