# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Shares of the held-out gap that the causes explain, and the choice of the headline.

The gap is the sum of squares of the weighted residual of the model. Causes are added one by one,
in order of gain; intervals come from resampled blocks (bootstrap). The headline lists the causes
with a large enough share, the others are minor.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import block_rows
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.posterior import JointFit
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np

#: Number of bootstrap samples: ends of a 95 % interval are accurate to a tenth of its width.
_RESAMPLINGS = 500


@dataclass(frozen=True)
class Attribution:
    """
    The gap, and the gain (reduction of the gap) of each named cause, per block of rows.

    Attributes
    ----------
    order : tuple of int
        Indices of the named causes in the order in which they are added, largest gain first.
    whole : ndarray, shape (B,)
        The gap: squared held-out residual without named causes.
    taken : ndarray, shape (K, B)
        Gain of each named cause, in the order of the explanation.

    """

    order: tuple[int, ...]
    whole: FloatArray
    taken: FloatArray

    def share(self, names: Sequence[int]) -> float:
        """Return the share of the gap that some causes explain together, at most 1."""
        share = self.taken[list(names)].sum() / max(float(self.whole.sum()), 1e-300)
        return min(float(share), 1.0)

    def interval(self, names: Sequence[int], rng: np.random.Generator) -> tuple[float, float]:
        """Return the 95 % interval of the share that some causes explain together."""
        drawn = rng.integers(len(self.whole), size=(_RESAMPLINGS, len(self.whole)))
        taken = self.taken[list(names)].sum(axis=0)[drawn].sum(axis=1)
        shares = taken / np.maximum(self.whole[drawn].sum(axis=1), 1e-300)
        low, high = np.quantile(shares, [0.025, 0.975])
        return min(float(low), 1.0), min(float(high), 1.0)


def headline(
    explanation: Explanation, unseen: Evidence | None, least: float, settings: DiagnosisSettings
) -> tuple[Explanation, Attribution]:
    """
    Move causes with a small share to the minor causes; return the shares of all others.

    Shares are cross-validated, and measured on held-out data if there are any. A cause is minor
    if its larger share is below `least`, and no joint has a gap without it: a cause may act in
    some motions only. It is minor as well if it increases one of the prediction errors. The
    returned shares are those of held-out data if there are any.

    Parameters
    ----------
    explanation : Explanation
        The fitted causes.
    unseen : Evidence or None
        Held-out data.
    least : float
        Smallest share of a cause in the headline.
    settings : DiagnosisSettings
        Limits of a residual without gap.

    """
    fitted = left_out(explanation)
    held_out = None if unseen is None else predicted(explanation, fitted.order, unseen)
    causes = range(len(explanation.steps))
    measured = [fitted] if held_out is None else [fitted, held_out]
    share = np.array([max(one.share([k]) for one in measured) for k in causes])
    for k in np.argsort(share, kind='stable').tolist():
        if share[k] >= least:
            break
        fewer = explanation.without(k)
        limits = explanation.evidence.limits(explanation.residual, settings)
        opens = (fewer.chi2_per_row > limits) & (explanation.chi2_per_row <= limits)
        if not np.any(opens):
            return headline(fewer, unseen, least, settings)
    worse = [k for k in causes if min(one.share([k]) for one in measured) < 0.0]
    if worse:
        return headline(explanation.without(*worse), unseen, least, settings)
    return explanation, held_out or fitted


def predicted(explanation: Explanation, order: Sequence[int], unseen: Evidence) -> Attribution:
    """Return the gain of each cause on held-out data; causes are added in a given order."""
    fewer = [explanation.only(order[:count]) for count in range(1, len(order))]
    every = [explanation.reference, *(one.fitted for one in fewer), explanation.fitted]
    arms = [one.arm for one in every[: len(order) + 1]]
    squares = [unseen.block_squares(unseen.residuals(arm)).sum(axis=1) for arm in arms]
    taken = np.zeros((len(order), len(squares[0])))
    for position, k in enumerate(order):
        taken[k] = squares[position] - squares[position + 1]
    return Attribution(tuple(order), squares[0], taken)


def left_out(explanation: Explanation) -> Attribution:
    """Return the cross-validated gain of each cause, added in order of gain."""
    assert explanation.problem is not None
    problem, own = explanation.problem, explanation.fitted
    linear = problem.linear(own.named)
    folds, spans = _folds(problem, linear), linear.spans
    count = len(own.named)
    remaining, order = list(range(count)), list[int]()

    def left(names: Sequence[int]) -> FloatArray:
        others = [spans[n] for n in range(count) if n not in names]
        absent = [k for span in others for k in range(span.start, span.stop)]
        return np.concatenate([one.left(absent) for one in folds])

    before = whole = left(())
    taken = np.zeros((count, len(whole)))
    while remaining:
        after = {k: left([*order, k]) for k in remaining}
        best = min(remaining, key=lambda k: float(after[k].sum()))
        taken[best], before = before - after[best], after[best]
        order.append(best)
        remaining.remove(best)
    return Attribution(tuple(order), whole, taken)


@dataclass(frozen=True)
class _Fold:
    """
    A part of a recording, with the posterior of all parameters fitted to the other parts.

    Attributes
    ----------
    columns : sequence of ndarray, each (m, p)
        Weighted columns of each block; zero for parameters that are not part of the arm.
    target : sequence of ndarray, each (m,)
        Weighted residual of each block.
    means, covariance : ndarray, shape (p,), (p, p)
        The posterior.

    """

    columns: Sequence[FloatArray]
    target: Sequence[FloatArray]
    means: FloatArray
    covariance: FloatArray

    def left(self, absent: Sequence[int]) -> FloatArray:
        """Return the squared residual of each block, given that some parameters are zero."""
        values, border = self.means, self.covariance[:, absent]
        if absent:
            values = values - border @ np.linalg.solve(border[absent], values[absent])
        pairs = zip(self.columns, self.target, strict=True)
        return np.array([np.sum((y - x @ values) ** 2) for x, y in pairs])


def _folds(problem: JointFit, linear: Nuisance) -> list[_Fold]:
    """Return the folds of the diagnosed day, each predicted from all other rows."""
    rows, found = linear.rows, list[_Fold]()
    part_of_arm = np.ones(linear.cross.shape[1], dtype=bool)
    part_of_arm[: linear.rank] = problem.stated
    part_of_arm[linear.discrepancy] = False
    for k in problem.recordings:
        if not rows.today[k]:
            continue
        block, fold = block_rows([part for part in rows.data if part.fold == k])
        x, y = linear.rows_of(k), linear.residual[k].T
        for one in np.unique(fold):
            blocks = [block == number for number in np.flatnonzero(fold == one)]
            columns = [x[own].reshape(-1, x.shape[2]) for own in blocks]
            target = [y[own].ravel() for own in blocks]
            less = k, np.concatenate(columns), np.concatenate(target)
            under = linear.marginal(problem.setting, problem.recordings, less)
            columns = [own * part_of_arm for own in columns]
            found.append(_Fold(columns, target, *linear.whole(under)))
    return found
