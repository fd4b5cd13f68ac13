# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Estimates from bags: compression of bags to normal equations, their sums, fits and covariance.

Standard deviations follow from the spectrum of the residuals, which normal equations do not
contain. A second pass over the bags therefore computes the noise products at the estimate of the
arm. Noise products add up over bags, so the result equals one identification of all bags.

"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
import datetime

from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.estimate import ParameterName
from armid_ros.fleet.bags import BagFile, DAY_NS
from armid_ros.fleet.plan import filters_at, Job
from armid_ros.fleet.store import fetched
from armid_ros.identification.fitting.covariance import noise_products, sandwich
from armid_ros.identification.fitting.identifiability import bounds, identifiable_base
from armid_ros.identification.fitting.least_squares import (
    NormalEquations,
    weighted_fit,
    WeightedFit,
    within_bounds,
)
from armid_ros.identification.rows.checks import check_positions, check_torque, resting
from armid_ros.identification.rows.regression import Regression
from armid_ros.identification.rows.streaming import streamed
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np


@dataclass(frozen=True)
class Refused:
    """
    Bag that the identification of its arm leaves out, with the reason.

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


@dataclass(frozen=True, eq=False)
class FleetEstimate:
    """
    Parameter estimate of an arm, from one bag or from all its bags.

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
    Parameters fitted by least squares, without standard deviations.

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
        """Fit parameters to normal equations; return None if there are too few samples."""
        base, kept = identifiable_base(job.theory, normal)
        if normal.counts.sum() < 2 * base.rank:
            return None
        fit = weighted_fit(normal.restrict(kept), weighted=job.settings.weighted)
        values = within_bounds(fit.values, fit.factor, bounds(job.arm, base))
        return cls(base, tuple(kept), replace(fit, values=values))

    def noise(self, rows: Iterable[Regression]) -> FloatArray:
        """Return the covariance (r, r) that noise causes in the normal equations of `rows`."""
        products = np.zeros((len(self.kept), len(self.kept)))
        for part in rows:
            some = part.restrict(self.kept)
            weights = some.informative / self.fit.scale
            residual = some.tau - some.columns @ self.fit.values
            products += noise_products([some], residual * weights, weights, self.fit.inverse)
        return products

    def estimate(self, normal: NormalEquations, noise: FloatArray) -> FleetEstimate:
        """Return the estimate, with standard deviations from the noise covariance (r, r)."""
        some, inverse = normal.restrict(self.kept), self.fit.inverse
        return FleetEstimate(
            self.base.parameters,
            self.fit.values,
            np.sqrt(np.diag(sandwich(inverse @ inverse.T, noise))),
            some.joint_std(self.fit.values),
            some.relative_error_percent(self.fit.values),
            float(np.linalg.cond(self.fit.factor)),
        )


@dataclass(frozen=True, eq=False)
class MergedBags:
    """
    Sum of the normal equations of several bags of one arm.

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
    def of(cls, bag: BagSummary | Refused) -> MergedBags:
        """Convert the summary of a bag, or a refused bag, to a sum of a single bag."""
        if isinstance(bag, Refused):
            return cls(refused=(bag,))
        version = bag.bag.url, bag.bag.version
        return cls(bag.normal, bag.seconds, (version,), not bag.computed)

    @classmethod
    def together(cls, parts: Sequence[MergedBags]) -> MergedBags:
        """Return the sum of the normal equations of several bags."""
        known = [part.normal for part in parts if part.normal is not None]
        return cls(
            sum(known[1:], known[0]) if known else None,
            sum(part.seconds for part in parts),
            tuple(version for part in parts for version in part.versions),
            sum(part.found for part in parts),
            tuple(refused for part in parts for refused in part.refused),
        )


@dataclass(frozen=True, eq=False)
class BagSummary:
    """
    Normal equations of a bag, and the parameter estimate from this bag alone.

    Attributes
    ----------
    bag : BagFile
        The bag.
    day : str
        Day of the path, or of the first timestamp, such as 2026-01-31.
    start_ns : int
        First timestamp [ns]; shifted to `day` if it is more than a day away from that day.
    seconds : float
        Time from the first sample to the last [s].
    normal : NormalEquations
        Normal equations of the rows, for the theoretically identifiable parameters.
    own : FleetEstimate or None
        Estimate from this bag; None if the bag is too short, or was found in the results.
    motion : dict
        Further columns of the table ``bags``; empty if the bag was found in the results.
    computed : bool
        False if the bag was found in the results of an earlier run.
    rows : tuple of Regression or None
        Rows of the bag, if they fit into the memory; None if the bag has to be read again.

    """

    bag: BagFile
    day: str
    start_ns: int
    seconds: float
    normal: NormalEquations
    own: FleetEstimate | None = None
    motion: Mapping[str, object] = field(default_factory=dict)
    computed: bool = True
    rows: tuple[Regression, ...] | None = None

    def rows_again(self, job: Job) -> Iterator[Regression]:
        """Yield the regression rows of the bag from memory, or by a second reading of the bag."""
        if self.rows is not None:
            yield from self.rows
            return
        with fetched(self.bag.url) as path:
            for _, parts in pieces(path, job):
                yield from parts


def prepare(bag: BagFile, job: Job, bags_of_arm: int = 1) -> BagSummary | Refused:
    """
    Return the summary of a bag, or a `Refused` with the reason for a bag that is not usable.

    Parameters
    ----------
    bag : BagFile
        The bag.
    job : Job
        Model and filters.
    bags_of_arm : int
        Number of bags that share the memory for rows.

    Raises
    ------
    StoreError
        If the store did not deliver the bag.

    """
    path = bag.url
    try:
        with fetched(bag.url) as path:
            # bytes of rows in memory until the fit; others are read again
            return _prepared(bag, path, job, 48_000_000 // max(1, bags_of_arm))
    except ArmidError as error:
        # the message names the URL of the bag, not the path of its copy
        return Refused(bag, str(error).replace(path, bag.url))


def pieces(path: str, job: Job) -> Iterator[tuple[Recording, Sequence[Regression]]]:
    """Read a bag piece by piece; yield each piece with the regression rows of the piece."""
    yield from streamed(
        path,
        job.arm,
        job.theory.independent,
        lambda piece: filters_at(job.filters, 1.0 / piece.period, path),
        job.samples,
        topic=job.settings.topic,
        settings=job.settings.reading,
    )


def _prepared(bag: BagFile, path: str, job: Job, budget: int) -> BagSummary:
    robot = job.arm.robot
    normal: NormalEquations | None = None
    kept: list[Regression] | None = []
    start_ns, samples, seconds = 0, 0, 0.0
    lowest, highest = np.full(robot.n_joints, np.inf), np.full(robot.n_joints, -np.inf)
    top_speed = np.zeros(robot.n_joints)
    for piece, parts in pieces(path, job):
        start_ns = start_ns or piece.start_ns
        samples, seconds = samples + len(piece), seconds + piece.duration
        lowest = np.minimum(lowest, piece.q.min(axis=0))
        highest = np.maximum(highest, piece.q.max(axis=0))
        for part in parts:
            top_speed = np.maximum(top_speed, np.abs(part.motion.dq).max(axis=0))
        if not parts:
            continue
        if normal is None:
            check_torque(job.arm, [piece], parts)
        own_normal = NormalEquations.of(parts)
        normal = own_normal if normal is None else normal + own_normal
        if kept is not None:
            kept.extend(parts)
            if sum(part.columns.nbytes for part in kept) > budget:
                kept = None
    check_positions(robot, path, lowest, highest)
    motion = {
        'samples': samples,
        'lowest': lowest,
        'highest': highest,
        'top_speed': top_speed,
        'notes': list(resting(robot, path, highest - lowest)),
    }
    if normal is None:
        raise IdentificationError(
            f'{path}: {seconds:.2f} s in {samples} samples is too short; '
            'record a movement of several seconds'
        )
    fit = FleetFit.of(normal, job)
    own = None
    if fit is not None:
        rows = (part for _, parts in pieces(path, job) for part in parts) if kept is None else kept
        own = fit.estimate(normal, fit.noise(rows))
    stamped = datetime.datetime.fromtimestamp(start_ns * 1e-9, datetime.UTC)
    day = bag.day or stamped.date().isoformat()
    apart = datetime.date.fromisoformat(day) - stamped.date()
    # stamps may count from the start of a computer; a time zone makes one day of difference
    if abs(apart.days) > 1:
        start_ns += apart.days * DAY_NS
    held = None if kept is None else tuple(kept)
    return BagSummary(bag, day, start_ns, seconds, normal, own, motion, rows=held)
