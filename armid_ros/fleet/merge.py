# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
From bags to their arm: triangles merged in a tree, a fit, and its deviations.

The deviations of a fit come from the spectrum of its residuals, which no summary of fixed size
has; so bags are asked a second time, for the noise products at the values of their arm. These add
up over bags, and what comes out is that of one identification of all bags.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.estimate import ParameterName
from armid_ros.fleet.job import Job
from armid_ros.fleet.summary import (
    BagSummary,
    MotionStatistics,
    noise_of,
    PreparedBag,
    Refused,
    rows_of,
)
from armid_ros.identification.fitting.excited import bounds, identifiable_base
from armid_ros.identification.fitting.triangle import (
    fit_triangle,
    joint_std,
    Triangle,
    TriangleFit,
)
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np

#: Triangles that one step of a tree merges.
FAN_IN = 16


@dataclass(frozen=True, eq=False)
class Branch:
    """
    Bags of one arm, merged.

    Attributes
    ----------
    triangle : Triangle or None
        Of all their rows; None if all were refused.
    motion : MotionStatistics or None
        How the arm moved.
    versions : tuple of (str, str)
        URL and version of every bag in it.
    refused : tuple of Refused
        Bags that are not in it.

    """

    triangle: Triangle | None
    motion: MotionStatistics | None
    versions: tuple[tuple[str, str], ...]
    refused: tuple[Refused, ...] = ()
    found: int = 0

    @classmethod
    def of(cls, summary: BagSummary | Refused) -> Branch:
        """Return the branch of one bag."""
        if isinstance(summary, Refused):
            return cls(None, None, (), (summary,))
        version = (summary.bag.url, summary.bag.version)
        found = 0 if summary.computed else 1
        return cls(summary.triangle, summary.motion, (version,), found=found)


@dataclass(frozen=True, eq=False)
class ArmFit:
    """
    The values of an arm, before their deviations.

    Attributes
    ----------
    base : BaseParameters
        What its bags tell apart.
    kept : tuple of int
        Columns of the theory that they keep.
    fit : TriangleFit
        The fit in these.

    """

    base: BaseParameters
    kept: tuple[int, ...]
    fit: TriangleFit


@dataclass(frozen=True, eq=False)
class Root:
    """
    All bags of an arm, merged and fitted.

    Attributes
    ----------
    branch : Branch
        All of them.
    fit : ArmFit or None
        Their values; None if all were refused.

    """

    branch: Branch
    fit: ArmFit | None


@dataclass(frozen=True, eq=False)
class ArmEstimate:
    """
    What the bags of an arm tell together.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Base parameters and those of the effects.
    values, std : ndarray, shape (r,)
        Values and standard deviations.
    covariance : ndarray, shape (r, r)
        Covariance.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of each joint [N m].
    relative_error_percent : float
        100 |tau - tau_hat| / |tau| over all joints and bags.
    condition_number : float
        Of the weighted regressor.
    motion : MotionStatistics
        How the arm moved.
    versions : tuple of (str, str)
        URL and version of every bag.

    """

    parameters: tuple[ParameterName, ...]
    values: FloatArray
    std: FloatArray
    covariance: FloatArray
    joint_std: FloatArray
    relative_error_percent: float
    condition_number: float
    motion: MotionStatistics
    versions: tuple[tuple[str, str], ...]


def merged(branches: Sequence[Branch]) -> Branch:
    """Return one branch of several."""
    triangles = [branch.triangle for branch in branches if branch.triangle is not None]
    motions = [branch.motion for branch in branches if branch.motion is not None]
    return Branch(
        Triangle.merged(triangles) if triangles else None,
        sum(motions[1:], start=motions[0]) if motions else None,
        tuple(version for branch in branches for version in branch.versions),
        tuple(refused for branch in branches for refused in branch.refused),
        sum(branch.found for branch in branches),
    )


def rooted(branches: Sequence[Branch], job: Job) -> Root:
    """Merge what is left of a tree, and fit the bags of the arm."""
    branch = merged(branches)
    if branch.triangle is None:
        return Root(branch, None)
    base, kept = identifiable_base(job.theory, branch.triangle)
    fit = fit_triangle(
        branch.triangle.restrict(kept), weighted=job.weighted, bounds=bounds(job.arm, base)
    )
    return Root(branch, ArmFit(base, tuple(kept), fit))


def noise_products_of(prepared: PreparedBag, fit: ArmFit | None, job: Job) -> Packed | None:
    """Return what the residuals of a bag at its arm's values say of the deviations."""
    if fit is None or isinstance(prepared.summary, Refused):
        return None
    return Packed.of(noise_of(rows_of(prepared, job), fit.fit, fit.kept))


def summed(products: Sequence[Packed | None]) -> Packed | None:
    """Add noise products up."""
    there = [one.numbers for one in products if one is not None]
    return Packed(np.sum(there, axis=0)) if there else None


def estimated(root: Root, products: Packed | None, job: Job) -> ArmEstimate | None:
    """Return the estimate of an arm; None if it has no bags."""
    branch, fit = root.branch, root.fit
    if fit is None or products is None or branch.triangle is None or branch.motion is None:
        return None
    triangle = branch.triangle.restrict(fit.kept)
    covariance = fit.fit.covariance(products.matrix)
    squares = triangle.squares(fit.fit.values).sum() / triangle.torque_squares.sum()
    return ArmEstimate(
        fit.base.parameters,
        fit.fit.values,
        np.sqrt(np.diag(covariance)),
        covariance,
        joint_std(triangle, fit.fit.values),
        float(100.0 * np.sqrt(squares)),
        fit.fit.condition_number,
        branch.motion,
        branch.versions,
    )


@dataclass(frozen=True, eq=False)
class Packed:
    """
    A symmetric matrix as its upper triangle.

    Attributes
    ----------
    numbers : ndarray, shape (r (r + 1) / 2,)
        Row by row.

    """

    numbers: FloatArray

    @classmethod
    def of(cls, matrix: FloatArray) -> Packed:
        """Pack a symmetric matrix."""
        return cls(matrix[np.triu_indices(len(matrix))])

    @property
    def matrix(self) -> FloatArray:
        """Return the whole matrix, shape (r, r)."""
        size = int((np.sqrt(8.0 * len(self.numbers) + 1.0) - 1.0) / 2.0)
        upper = np.zeros((size, size))
        upper[np.triu_indices(size)] = self.numbers
        return np.asarray(upper + np.triu(upper, 1).T)
