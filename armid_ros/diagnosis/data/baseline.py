# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What is known of an arm before its recordings are looked at: from others, and from its description.

The misfit is what a model leaves of recordings in which nothing was wrong: no real arm is as its
model to the noise. What is left of recordings that it was identified from is smaller than of
others, so each of them is predicted with parameters that the others have. What others do not tell
stays as it is in the model, as far as a description can be believed: a joint may have been moved
in one recording alone.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.trajectory import fold_rows, Trajectory, weighted_rows
from armid_ros.effects import Effect
from armid_ros.effects.load import described_spread
from armid_ros.identification.fitting.normal_equations import informative_solution, NormalEquations
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters, group_columns
from armid_ros.motion import FloatArray
import numpy as np

#: Free columns of which the others leave less than this share of their length are grouped.
EXCITED = 1e-4


@dataclass(frozen=True)
class Prior:
    """
    What other data tell of base parameters.

    Attributes
    ----------
    data : tuple of Trajectory
        Those data.
    rows : tuple of ndarray, each (M, n, r)
        Their columns over the unit of the gap.
    rest : tuple of ndarray, each (M, n)
        What the arm leaves of them, over the unit.

    """

    data: tuple[Trajectory, ...]
    rows: tuple[FloatArray, ...]
    rest: tuple[FloatArray, ...]

    @cached_property
    def columns(self) -> FloatArray:
        """Return a row for every joint and sample, shape (S, r)."""
        return np.concatenate([rows.reshape(-1, rows.shape[2]) for rows in self.rows])

    @cached_property
    def residual(self) -> FloatArray:
        """Return what is left in these rows, shape (S,)."""
        return np.concatenate([rest.ravel() for rest in self.rest])

    @cached_property
    def of_change(self) -> NormalEquations:
        """What the data tell of a change of the r values that are free."""
        return NormalEquations.of_rows(self.columns, self.residual)

    def nearest(self, columns: FloatArray) -> FloatArray:
        """Return the changes of what is free that come nearest to columns (S, p), shape (r, p)."""
        return informative_solution(self.of_change.matrix, self.columns.T @ columns)

    def recordings(self, change: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Yield the columns of each recording, (S, r), and what a change leaves of it, (S,)."""
        for fold in sorted({part.fold for part in self.data}):
            own = [k for k, part in enumerate(self.data) if part.fold == fold]
            rows = np.concatenate([self.rows[k].reshape(-1, len(change)) for k in own])
            yield rows, np.concatenate([self.rest[k].ravel() for k in own]) - rows @ change

    def regressions(self, change: FloatArray, named: int) -> list[Regression]:
        """Return the data as a problem in which so many more columns do not act."""
        return [
            Regression(
                part.at_rows.with_torque(rest - rows @ change),
                np.concatenate([rows, np.zeros((*rest.shape, named))], axis=2),
                part.informative,
                part.source,
            )
            for part, rows, rest in zip(self.data, self.rows, self.rest, strict=True)
        ]


def excited(
    arm: ArmModel, theory: BaseParameters, data: Sequence[Trajectory]
) -> tuple[BaseParameters, list[FloatArray]]:
    """Return what the motion can tell of rigid body and known effects, and its columns."""
    columns = [part.reduce(arm.columns(part.motion)[:, :, theory.independent]) for part in data]
    stacked = np.concatenate([block.reshape(-1, theory.rank) for block in columns])
    names = tuple(theory.standard[column] for column in theory.independent)
    kept = group_columns(stacked, names, tolerance=EXCITED)
    if kept.rank == theory.rank:
        return theory, columns
    base = replace(
        theory,
        parameters=tuple(theory.parameters[k] for k in kept.independent),
        independent=theory.independent[kept.independent],
        grouping=kept.grouping @ theory.grouping,
    )
    return base, [block[:, :, kept.independent] for block in columns]


def described_precision(base: BaseParameters, arm: ArmModel) -> FloatArray:
    """
    Return how strongly the description holds the base parameters, as a precision (r, r).

    It is believed to a factor or so: data decide whatever they tell, and what they tell hardly
    stays where it predicts other motions well. A value of zero of an effect is no description.

    """
    size = len(arm.robot.rigid_parameters)
    spread = np.full(len(base.standard), np.inf)
    spread[:size] = described_spread(arm.robot).ravel()
    known = np.abs(arm.theta[size:])
    spread[size:] = np.where(known > 0.0, known, np.inf)
    described = ~np.any((base.grouping != 0.0) & np.isinf(spread), axis=1)
    finite = np.where(np.isfinite(spread), spread, 0.0)
    grouped = base.grouping[described] * finite
    covariance = grouped @ grouped.T
    precision = np.zeros((base.rank, base.rank))
    precision[np.ix_(described, described)] = np.linalg.pinv(covariance, hermitian=True)
    return precision


@dataclass(frozen=True)
class Baseline:
    """
    Recordings in which nothing was wrong.

    Attributes
    ----------
    data : tuple of Trajectory
        The recordings.
    residual : tuple of ndarray, each (M, n)
        What the model leaves of them [N m].
    misfit : ndarray, shape (n,)
        Root mean square that it leaves of recordings it was not identified from [N m].
    varies : ndarray, shape (n,)
        Squares that it leaves of the recording it predicts worst, over those of all: another
        motion makes another misfit.

    """

    data: tuple[Trajectory, ...]
    residual: tuple[FloatArray, ...]
    misfit: FloatArray
    varies: FloatArray

    @classmethod
    def of(cls, arm: ArmModel, data: Sequence[Trajectory], rng: np.random.Generator) -> Baseline:
        """Measure the misfit of a model."""
        residual = [part.residual(arm) for part in data]
        base, columns = excited(arm, arm.base_parameters(rng), data)
        held = described_precision(base, arm)
        informative = np.concatenate([part.informative for part in data])
        left = np.concatenate(residual)
        w = np.concatenate(columns)
        informative[:, ~informative.any(axis=0)] = True  # of a joint that never moved, all of it
        scale = np.sqrt(np.mean(left**2, axis=0, where=informative))
        weight = informative / np.maximum(scale, 1e-12)
        rows = w * weight[:, :, np.newaxis]
        aim = left * weight
        fold = fold_rows(data)
        folds = range(int(fold.max()) + 1)
        own = [np.einsum('rnp,rnq->pq', rows[fold == k], rows[fold == k]) for k in folds]
        to = [np.einsum('rnp,rn->p', rows[fold == k], aim[fold == k]) for k in folds]
        whole = np.linalg.lstsq(sum(own) + held, sum(to), rcond=1e-10)[0]
        for k in folds:
            others = np.linalg.lstsq(sum(own) - own[k] + held, sum(to) - to[k], rcond=1e-10)[0]
            left[fold == k] += w[fold == k] @ (whole - others)
        others = np.sqrt(np.mean(left**2, axis=0, where=informative))
        counts = np.array([informative[fold == k].sum(axis=0) for k in folds])
        sums = np.array(
            [np.sum(left[fold == k] ** 2, axis=0, where=informative[fold == k]) for k in folds]
        )
        worst = np.max(sums / np.maximum(counts, 1), axis=0)
        return cls(
            tuple(data),
            tuple(residual),
            np.sqrt(scale * others),
            worst / np.maximum(others**2, 1e-300),
        )

    @property
    def error(self) -> float:
        """Share of the torque that the model leaves, of all joints together."""
        left = np.concatenate([rows.ravel() for rows in self.residual])
        torque = np.concatenate([part.torque.ravel() for part in self.data])
        return float(np.linalg.norm(left) / max(float(np.linalg.norm(torque)), 1e-300))

    def prior(self, arm: ArmModel, base: BaseParameters) -> Prior:
        """
        Return what these recordings tell of what is free of an arm.

        It is the arm whose misfit was measured, or has more effects that are zero.

        """
        rows = [
            part.reduce(arm.columns(part.motion)[:, :, base.independent]) for part in self.data
        ]
        return Prior(self.data, self._weighted(rows), self._weighted(self.residual))

    def columns(self, arm: ArmModel, effect: Effect, kept: Sequence[int]) -> FloatArray:
        """Return the columns of an effect over the misfit, one row a row and joint, (S, p)."""
        rows = [part.columns(arm, effect)[:, :, list(kept)] for part in self.data]
        return np.concatenate([part.reshape(-1, len(kept)) for part in self._weighted(rows)])

    def _weighted(self, rows: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        return tuple(weighted_rows(rows, self.data, [self.misfit] * len(self.data)))
