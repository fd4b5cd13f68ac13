# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Share of the held-out squared residual that each cause explains, and the causes of the headline.

The gap is the sum of squared weighted residuals of the model. Causes are added one by one, in
order of their gain (reduction of the gap). Intervals come from resampled time blocks (bootstrap).
The headline lists the causes with a large enough share; the other causes are minor.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import block_rows
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.joint_fit import JointFit
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Attribution:
    """
    Squared held-out residual of each time block, and its reduction by each named cause.

    Attributes
    ----------
    order : tuple of int
        Indices of the named causes in the order in which they are added, largest gain first.
    gap : ndarray, shape (B,)
        Squared held-out residual of each block without named causes.
    gains : ndarray, shape (K, B)
        Its reduction by each named cause, in the order of the explanation.

    """

    order: tuple[int, ...]
    gap: FloatArray
    gains: FloatArray

    def share(self, names: Sequence[int]) -> float:
        """Return the share of the squared residual that given causes explain, at most 1."""
        share = self.gains[list(names)].sum() / max(float(self.gap.sum()), 1e-300)
        return min(float(share), 1.0)

    def interval(self, names: Sequence[int], rng: np.random.Generator) -> tuple[float, float]:
        """Return the 95 % interval of the share that given causes explain together."""
        # with 500 resamples, the ends of the interval are accurate to a tenth of its width
        drawn = rng.integers(len(self.gap), size=(500, len(self.gap)))
        gains = self.gains[list(names)].sum(axis=0)[drawn].sum(axis=1)
        shares = gains / np.maximum(self.gap[drawn].sum(axis=1), 1e-300)
        low, high = np.quantile(shares, [0.025, 0.975])
        return min(float(low), 1.0), min(float(high), 1.0)


def headline(
    explanation: Explanation, unseen: Evidence | None, least: float, settings: DiagnosisSettings
) -> tuple[Explanation, Attribution]:
    """
    Move causes that explain little to the minor causes; return the shares of the others.

    Shares are cross-validated, and also measured on held-out recordings if there are any. A cause
    is minor if its larger share is below `least`, or its returned share below `inexact`, and no
    joint has a gap without it: a cause may act in some motions only. It is minor as well if its
    returned share is below -`inexact`. The returned shares are those of held-out recordings if
    there are any that show a cause.

    Parameters
    ----------
    explanation : Explanation
        The fitted causes.
    unseen : Evidence or None
        Held-out recordings.
    least : float
        Smallest share of a cause in the headline.
    settings : DiagnosisSettings
        Limits of a residual without gap.

    """
    if not explanation.steps:
        return explanation, Attribution((), np.ones(1), np.zeros((0, 1)))
    fitted = cross_validated(explanation)
    held_out = None if unseen is None else held_out_gains(explanation, fitted.order, unseen)
    causes = range(len(explanation.steps))
    measured = [fitted] if held_out is None else [fitted, held_out]
    share = np.array([max(one.share([k]) for one in measured) for k in causes])
    stated, inexact = [measured[-1].share([k]) for k in causes], settings.thresholds.inexact
    for k in np.argsort(share, kind='stable').tolist():
        if share[k] >= least and stated[k] >= min(least, inexact):
            continue
        fewer = explanation.without(k)
        limits = explanation.evidence.limits(explanation.residual, settings)
        opens = (fewer.chi2_per_row > limits) & (explanation.chi2_per_row <= limits)
        if not np.any(opens):
            return headline(fewer, unseen, least, settings)
    worse = [k for k in causes if stated[k] < -inexact]
    if worse:
        return headline(explanation.without(*worse), unseen, least, settings)
    seen = held_out is not None and held_out.share(causes) >= inexact
    return explanation, measured[-1] if seen else fitted


def held_out_gains(
    explanation: Explanation, order: Sequence[int], unseen: Evidence
) -> Attribution:
    """Add causes in order; return how much each one reduces the squared held-out residual."""
    fewer = [explanation.only(order[:count]) for count in range(1, len(order))]
    every = [explanation.reference, *(one.fitted for one in fewer), explanation.fitted]
    arms = [one.arm for one in every[: len(order) + 1]]
    squares = [unseen.block_squares(unseen.residuals(arm)).sum(axis=1) for arm in arms]
    gains = np.zeros((len(order), len(squares[0])))
    gains[list(order)] = -np.diff(squares, axis=0)
    return Attribution(tuple(order), squares[0], gains)


def cross_validated(explanation: Explanation) -> Attribution:
    """Add causes, best first; return the reduction of the cross-validated residual by each."""
    assert explanation.problem is not None
    problem, named = explanation.problem, explanation.fitted.named
    linear = problem.linear(named)
    folds, spans = list(_folds(problem, linear)), linear.value_slices
    remaining, order = list(range(len(named))), list[int]()

    def squared_residual(causes: Sequence[int]) -> FloatArray:
        """Return the squared held-out residual (B,) of each block, with given causes only."""
        others = [spans[n] for n in range(len(named)) if n not in causes]
        absent = [k for span in others for k in range(span.start, span.stop)]
        squares = []
        for columns, target, means, covariance in folds:
            values = means
            if absent:
                border = covariance[:, absent]
                values = means - border @ np.linalg.solve(border[absent], means[absent])
            pairs = zip(columns, target, strict=True)
            squares += [np.sum((y - x @ values) ** 2) for x, y in pairs]
        return np.array(squares)

    before = gap = squared_residual(())
    gains = np.zeros((len(named), len(gap)))
    while remaining:
        after = {k: squared_residual([*order, k]) for k in remaining}
        best = min(remaining, key=lambda k: float(after[k].sum()))
        gains[best], before = before - after[best], after[best]
        order.append(best)
        remaining.remove(best)
    return Attribution(tuple(order), gap, gains)


def _folds(
    problem: JointFit, linear: Nuisance
) -> Iterator[tuple[list[FloatArray], list[FloatArray], FloatArray, FloatArray]]:
    """
    Yield each held-out fold of the diagnosed recordings, and a fit to the other rows.

    A fold has weighted columns (m, p) and residual (m,) of its blocks, and mean and covariance of
    all parameters, fitted to the other rows. Columns of parameters that the patched arm does not
    include, such as discrepancies, are zero.

    """
    rows = linear.rows
    part_of_arm = np.ones(linear.cross.shape[1], dtype=bool)
    part_of_arm[: linear.base.rank] = problem.patches_body
    part_of_arm[linear.base.rank : linear.columns[0].shape[2]] = False
    for k in (k for k in problem.recordings if rows.diagnosed[k]):
        block, fold = block_rows([part for part in rows.data if part.fold == k])
        x, y = linear.rows_of(k), linear.residual[k].T
        for one in np.unique(fold):
            blocks = [block == number for number in np.flatnonzero(fold == one)]
            columns = [x[own].reshape(-1, x.shape[2]) for own in blocks]
            target = [y[own].ravel() for own in blocks]
            less = k, np.concatenate(columns), np.concatenate(target)
            posterior = linear.posterior(problem.hyperparameters, problem.recordings, less)
            yield [own * part_of_arm for own in columns], target, *linear.moments(posterior)
