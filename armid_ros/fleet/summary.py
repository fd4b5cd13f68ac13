# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One bag as a summary of fixed size: a triangle, its own estimate, and how the arm moved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
import datetime

from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.estimate import ParameterName
from armid_ros.fleet.bags import BagFile
from armid_ros.fleet.job import Job
from armid_ros.fleet.store import fetched
from armid_ros.identification.fitting.excited import bounds, identifiable_base
from armid_ros.identification.fitting.least_squares import noise_products
from armid_ros.identification.fitting.triangle import (
    fit_triangle,
    joint_std,
    Triangle,
    TriangleFit,
)
from armid_ros.identification.rows.checks import check_positions, check_torque, resting
from armid_ros.identification.rows.regression import Regression
from armid_ros.identification.rows.streaming import streamed
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: Rows of an arm's bags that are kept until its estimate is known [bytes]; others are read again.
KEPT_BYTES = 48_000_000


@dataclass(frozen=True, eq=False)
class MotionStatistics:
    """
    How an arm moved, in numbers that add up over recordings.

    Attributes
    ----------
    samples : int
        Samples of the recording.
    seconds : float
        From the first to the last [s].
    lowest, highest : ndarray, shape (n,)
        Positions [rad or m].
    top_speed : ndarray, shape (n,)
        Of the filtered motion [rad/s or m/s].

    """

    samples: int
    seconds: float
    lowest: FloatArray
    highest: FloatArray
    top_speed: FloatArray

    def __add__(self, other: MotionStatistics) -> MotionStatistics:
        """Return those of both recordings."""
        return MotionStatistics(
            self.samples + other.samples,
            self.seconds + other.seconds,
            np.minimum(self.lowest, other.lowest),
            np.maximum(self.highest, other.highest),
            np.maximum(self.top_speed, other.top_speed),
        )


@dataclass(frozen=True, eq=False)
class OwnEstimate:
    """
    What a bag tells by itself.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Base parameters that it tells apart.
    values, std : ndarray, shape (r,)
        Values and standard deviations.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of each joint [N m].
    relative_error_percent : float
        100 |tau - tau_hat| / |tau|.
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
class BagSummary:
    """
    What is kept of a bag.

    Attributes
    ----------
    bag : BagFile
        Which one.
    day : str
        As 2026-01-31: that of its path, or of its first stamp.
    start_ns : int
        Its first stamp [ns].
    triangle : Triangle
        Its rows in the columns that the arm's theory keeps.
    motion : MotionStatistics
        How the arm moved.
    own : OwnEstimate or None
        What it tells by itself; None where it is too short for that.
    notes : tuple of str
        What a person should know.
    computed : bool
        False where it was found among the results.

    """

    bag: BagFile
    day: str
    start_ns: int
    triangle: Triangle
    motion: MotionStatistics
    own: OwnEstimate | None
    notes: tuple[str, ...] = ()
    computed: bool = True


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


@dataclass(frozen=True, eq=False)
class PreparedBag:
    """
    A bag that was read.

    Attributes
    ----------
    summary : BagSummary or Refused
        What travels.
    rows : tuple of Regression or None
        What does not; None where the bag is read again if they are needed.

    """

    summary: BagSummary | Refused
    rows: tuple[Regression, ...] | None = None


def prepare(bag: BagFile, job: Job, bags_of_arm: int = 1) -> PreparedBag:
    """
    Read a bag and compress it.

    Parameters
    ----------
    bag : BagFile
        The bag.
    job : Job
        Model and filters.
    bags_of_arm : int
        How many bags share the memory for rows that are kept.

    Raises
    ------
    StoreError
        The store did not deliver it.

    """
    path = bag.url
    try:
        with fetched(bag.url) as path:
            return _prepared(bag, path, job, KEPT_BYTES // max(1, bags_of_arm))
    except ArmidError as error:
        return PreparedBag(Refused(bag, _in_place(str(error), path, bag)))


def pieces(path: str, job: Job) -> Iterator[tuple[Recording, Sequence[Regression]]]:
    """Yield the rows of a bag piece by piece."""
    yield from streamed(
        path,
        job.arm,
        job.theory.independent,
        lambda piece: job.filters.at(1.0 / piece.period, path),
        job.samples,
        topic=job.topic,
        settings=job.reading,
    )


def rows_of(prepared: PreparedBag, job: Job) -> Iterator[Regression]:
    """Yield the rows of a bag, as they were kept or read again."""
    if prepared.rows is not None:
        yield from prepared.rows
        return
    with fetched(prepared.summary.bag.url) as path:
        for _, parts in pieces(path, job):
            yield from parts


def noise_of(rows: Iterable[Regression], fit: TriangleFit, kept: Sequence[int]) -> FloatArray:
    """
    Return the covariance of the products of columns and noise, shape (r, r).

    Parameters
    ----------
    rows : iterable of Regression
        Stretches, in all columns of the theory.
    fit : TriangleFit
        A fit in some of them, whose residuals tell the noise.
    kept : sequence of int
        In which.

    """
    products = np.zeros((len(kept), len(kept)))
    for part in rows:
        some = part if len(kept) == part.columns.shape[2] else part.restrict(kept)
        weights = some.informative / fit.scale
        residual = some.tau - some.columns @ fit.values
        products += noise_products([some], residual * weights, weights, fit.inverse)
    return products


def _prepared(bag: BagFile, path: str, job: Job, budget: int) -> PreparedBag:
    triangles: list[Triangle] = []
    motions: list[MotionStatistics] = []
    kept: list[Regression] | None = []
    start_ns = 0
    robot = job.arm.robot
    for piece, parts in pieces(path, job):
        start_ns = start_ns or piece.start_ns
        motions.append(_motion(piece, parts))
        if not parts:
            continue
        if not triangles:
            check_torque(job.arm, [piece], parts)
        triangles.append(Triangle.of(parts))
        if kept is not None:
            kept.extend(parts)
            if sum(part.columns.nbytes for part in kept) > budget:
                kept = None
    motion = sum(motions[1:], start=motions[0])
    check_positions(robot, path, motion.lowest, motion.highest)
    notes = resting(robot, path, motion.highest - motion.lowest)
    if not triangles:
        raise IdentificationError(
            f'{path}: {motion.seconds:.2f} s in {motion.samples} samples is too short; '
            'record a movement of several seconds'
        )
    triangle = Triangle.merged(triangles)
    day = bag.day or _day(start_ns)
    rows = (part for _, parts in pieces(path, job) for part in parts) if kept is None else kept
    own = _own(rows, triangle, job)
    summary = BagSummary(bag, day, start_ns, triangle, motion, own, notes)
    return PreparedBag(summary, None if kept is None else tuple(kept))


def _own(rows: Iterable[Regression], triangle: Triangle, job: Job) -> OwnEstimate | None:
    """Fit a bag by itself."""
    base, kept = identifiable_base(job.theory, triangle)
    if triangle.counts.sum() < 2 * base.rank:
        return None
    some = triangle.restrict(kept)
    fit = fit_triangle(some, weighted=job.weighted, bounds=bounds(job.arm, base))
    covariance = fit.covariance(noise_of(rows, fit, kept))
    squares = some.squares(fit.values).sum() / some.torque_squares.sum()
    return OwnEstimate(
        base.parameters,
        fit.values,
        np.sqrt(np.diag(covariance)),
        joint_std(some, fit.values),
        float(100.0 * np.sqrt(squares)),
        fit.condition_number,
    )


def _motion(piece: Recording, parts: Sequence[Regression]) -> MotionStatistics:
    speeds = [np.abs(part.motion.dq).max(axis=0) for part in parts]
    return MotionStatistics(
        len(piece),
        piece.duration,
        piece.q.min(axis=0),
        piece.q.max(axis=0),
        np.max([np.zeros(piece.n_joints), *speeds], axis=0),
    )


def _day(start_ns: int) -> str:
    return datetime.datetime.fromtimestamp(start_ns * 1e-9, datetime.UTC).date().isoformat()


def _in_place(message: str, path: str, bag: BagFile) -> str:
    """Name a bag by where it lies, not by where its copy was."""
    return message.replace(path, bag.url)
