# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is known of base parameters before the data: the description, and other recordings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.effects.load import described_spread
from armid_ros.identification.fitting.normal_equations import informative_solution
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
    def precision(self) -> FloatArray:
        """Products of the columns, shape (r, r)."""
        return np.asarray(self.columns.T @ self.columns)

    @cached_property
    def aim(self) -> FloatArray:
        """Products of the columns with what is left, shape (r,)."""
        return np.asarray(self.columns.T @ self.residual)

    def nearest(self, columns: FloatArray) -> FloatArray:
        """Return the changes of what is free that come nearest to columns (S, p), shape (r, p)."""
        return informative_solution(self.precision, self.columns.T @ columns)

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
