# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A fitted arm as a linear problem, in which every name can be asked for again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence, Trajectory
from armid_ros.diagnosis.data.rows import make_problem, Problem
from armid_ros.diagnosis.search.fit import Fitted
from armid_ros.diagnosis.search.held_out import held_out
from armid_ros.diagnosis.search.patch import Named
from armid_ros.diagnosis.search.round import Nuisance
from armid_ros.diagnosis.search.trial import Candidate, Trial
from armid_ros.motion import FloatArray
import numpy as np


class Again(NamedTuple):
    """
    What is there already, judged as if it were asked for now.

    Attributes
    ----------
    trial : Trial or None
        What it explains; None where nothing of it is visible.
    problem : Problem
        The problem, its columns first.
    nuisance : Nuisance
        What is fitted beside it.
    power : float
        Held-out squares without it.

    """

    trial: Trial | None
    problem: Problem
    nuisance: Nuisance
    power: float


@dataclass(frozen=True)
class View:
    """
    A fitted arm as a linear problem, from which names and free values can be taken away again.

    Attributes
    ----------
    problem : Problem
        All columns that were free, those of the base parameters first, and those of ``more``.
    fitted : Fitted
        The arm.
    more : tuple of Named
        Names that were not fitted, at values of zero.

    """

    problem: Problem
    fitted: Fitted
    more: tuple[Named, ...] = ()

    @classmethod
    def of(cls, fitted: Fitted, evidence: Evidence, more: Sequence[Named] = ()) -> View:
        """Make the problem of a fitted arm, and of names beside."""
        columns = [
            np.concatenate([own, *(_columns(one, fitted.arm, part) for one in more)], axis=2)
            for part, own in zip(evidence.data, fitted.columns, strict=True)
        ]
        problem = make_problem(evidence.data, evidence.sigma, fitted.residual, columns)
        return cls(problem, fitted, tuple(more))

    @property
    def first(self) -> int:
        """The first column of a name."""
        return int(self.fitted.columns[0].shape[2]) - len(self.fitted.estimate.values)

    def columns(self, name: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return the columns of the values of a name, and those of its shapes."""
        values, shapes = self.fitted.places[name]
        return tuple(self.first + k for k in values), tuple(self.first + k for k in shapes)

    def value(self, column: int) -> float:
        """Return the value of a column of a name."""
        return float(self.fitted.estimate.values[column - self.first])

    def without(
        self, columns: Sequence[int], values: Sequence[float], gone: Sequence[int] = ()
    ) -> tuple[Problem, tuple[int, ...], FloatArray, FloatArray]:
        """
        Return the problem as if some columns had a value of zero.

        Parameters
        ----------
        columns : sequence of int
            Columns to be put first, and their values given back to the residual.
        values : sequence of float
            Their values.
        gone : sequence of int
            Columns that are not there at all; their values were zero.

        Returns
        -------
        problem : Problem
        free : tuple of int
            The other columns.
        hold, pull : ndarray
            How these are held.

        """
        size = self.problem.x.shape[2]
        away = {*columns, *gone}
        others = [c for c in range(size) if c not in away]
        x = self.problem.x
        y = self.problem.y + x[:, :, list(columns)] @ np.asarray(values, dtype=float)
        moved = replace(self.problem, x=x[:, :, [*columns, *others]], y=y)
        hold = self.fitted.hold[np.ix_(others, others)]
        free = tuple(range(len(columns), len(columns) + len(others)))
        return moved, free, hold, self.fitted.pull[others]

    def dropped(self, column: int, value: float) -> View:
        """Return the view as if a column had a value of zero."""
        y = self.problem.y + self.problem.x[:, :, column] * value
        return replace(self, problem=replace(self.problem, y=y))

    def trial(
        self,
        candidate: Candidate,
        columns: Sequence[int],
        values: Sequence[float],
        gone: Sequence[int] = (),
    ) -> Again:
        """Judge what is there already as if it were asked for now."""
        problem, free, hold, pull = self.without(columns, values, gone)
        moved = replace(candidate, columns=slice(0, len(columns)))
        trials, power = held_out(problem, free, [moved], hold, pull)
        trial = trials[0] if trials else None
        return Again(trial, problem, Nuisance(free, hold, pull), float(power.sum()))

    def trial_of(self, name: int) -> Again:
        """Judge a name as if it were asked for now, beside the others."""
        own = self.fitted.named[name]
        columns, shapes = self.columns(name)
        span = slice(0, len(columns))
        candidate = Candidate.of(own.effect, span, own.kept, self.fitted.arm.robot)
        return self.trial(candidate, columns, [self.value(c) for c in columns], shapes)

    def trial_of_more(self, name: int) -> Again:
        """Judge a name that was not fitted beside those that were."""
        first = int(self.fitted.columns[0].shape[2])
        start = first + sum(len(one.kept) for one in self.more[:name])
        own = self.more[name]
        span = range(start, start + len(own.kept))
        others = [c for c in range(first, self.problem.x.shape[2]) if c not in span]
        candidate = Candidate.of(own.effect, slice(0, len(span)), own.kept, self.fitted.arm.robot)
        return self.trial(candidate, span, [0.0] * len(span), others)


def _columns(own: Named, arm: ArmModel, part: Trajectory) -> FloatArray:
    return part.columns(arm, own.effect)[:, :, list(own.kept)]
