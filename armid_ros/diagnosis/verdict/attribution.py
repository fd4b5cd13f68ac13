# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The share of the gap that each cause explains of held-out data, and which causes are the headline.

The gap is the sum of squares of the weighted residual of the model. Causes are added one by one,
the one with the largest gain first; intervals come from resampled blocks (bootstrap). The headline
has the causes whose share is large enough.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import block_rows
from armid_ros.diagnosis.search.explanation import as_bodies, Chosen, Explanation
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.posterior import JointFit
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np

#: Note where a cause shows only jointly with a rigid body that is common to both days.
_COMMON = (
    'the baseline did not determine the model for these motions: a rigid body and friction common '
    'to both were fitted'
)
#: Resamplings of the blocks: the ends of a 95 % interval are accurate to a tenth of it.
_RESAMPLINGS = 500


@dataclass(frozen=True)
class Attribution:
    """
    The gap and the gains of the names, block by block.

    Attributes
    ----------
    order : tuple of int
        The names of the explanation in the order in which they are added, largest gain first.
    whole : ndarray, shape (B,)
        The gap: held-out squares without any name.
    taken : ndarray, shape (K, B)
        Gain of each name, in the order of the explanation.
    predicted : bool
        Whether it is of held-out data, and not of folds of the data that names were fitted to.
    folds : Attribution or None
        The same of these folds, where both were asked for; see `shares_of`.

    """

    order: tuple[int, ...]
    whole: FloatArray
    taken: FloatArray
    predicted: bool = False
    folds: Attribution | None = None

    def share(self, names: Sequence[int]) -> float:
        """Return the share of the gap that some of the names explain together, at most all."""
        share = self.taken[list(names)].sum() / max(float(self.whole.sum()), 1e-300)
        return min(float(share), 1.0)

    def interval(self, names: Sequence[int], rng: np.random.Generator) -> tuple[float, float]:
        """Return the 95 % interval of that share."""
        drawn = rng.integers(len(self.whole), size=(_RESAMPLINGS, len(self.whole)))
        taken = self.taken[list(names)].sum(axis=0)[drawn].sum(axis=1)
        shares = taken / np.maximum(self.whole[drawn].sum(axis=1), 1e-300)
        low, high = np.quantile(shares, [0.025, 0.975])
        return min(float(low), 1.0), min(float(high), 1.0)


def attribute(explanation: Explanation, unseen: Evidence | None) -> Attribution:
    """
    Return the gain of each name.

    Parameters
    ----------
    explanation : Explanation
        The names, fitted.
    unseen : Evidence or None
        Held-out data; None predicts each fold of the data from the others.

    """
    folds = _left_out(explanation)
    return folds if unseen is None else _predicted(explanation, folds.order, unseen)


def _predicted(explanation: Explanation, order: Sequence[int], unseen: Evidence) -> Attribution:
    """Predict held-out data with the first name, the first two, and so on, fitted to the data."""
    fewer = [explanation.only(order[:count]) for count in range(1, len(order))]
    every = [explanation.reference, *(one.fitted for one in fewer), explanation.fitted]
    arms = [one.arm for one in every[: len(order) + 1]]
    squares = [unseen.block_squares(unseen.residuals(arm)).sum(axis=1) for arm in arms]
    taken = np.zeros((len(order), len(squares[0])))
    for position, k in enumerate(order):
        taken[k] = squares[position] - squares[position + 1]
    return Attribution(tuple(order), squares[0], taken, predicted=True)


def _left_out(explanation: Explanation) -> Attribution:
    """Predict each fold from all other data, adding the name with the largest gain at a time."""
    assert explanation.problem is not None
    problem, own = explanation.problem, explanation.fitted
    linear, count = problem.linear(own.named, own.values), len(own.named)
    remaining, order, used = list(range(count)), list[int](), list[int]()
    before = whole = _left(problem, linear, ())
    taken = np.zeros((count, len(whole)))
    while remaining:
        after = {k: _left(problem, linear, [*used, k]) for k in remaining}
        best = min(remaining, key=lambda k: float(after[k].sum()))
        taken[best], before = before - after[best], after[best]
        used.append(best)
        order.append(best)
        remaining.remove(best)
    return Attribution(tuple(order), whole, taken)


def _left(problem: JointFit, linear: Nuisance, names: Sequence[int]) -> FloatArray:
    """Return the squares that some of the names leave of each block, beside the other folds."""
    fewer = replace(linear, accepted=tuple(linear.accepted[k] for k in names))
    rows = linear.rows
    said = np.zeros(len(fewer.cross[0]), dtype=bool)
    said[: fewer.rank] = problem.stated
    for span in fewer.spans:
        said[span] = True
    found = []
    for k in problem.recordings:
        if not rows.today[k]:
            continue
        block, fold = block_rows([part for part in rows.data if part.fold == k])
        x, y = fewer.rows_of(k), fewer.residual[k].T
        for one in np.unique(fold):
            blocks = np.flatnonzero(fold == one)
            own = np.isin(block, blocks)
            flat, rest = x[own].reshape(-1, x.shape[2]), y[own].ravel()
            told = np.flatnonzero(np.any(flat, axis=1))
            part = flat[told], rest[told]
            values = fewer.means(fewer.marginal(problem.setting, problem.recordings, (k, *part)))
            left = y - x @ (said * values)
            found += [float(np.sum(left[block == each] ** 2)) for each in blocks]
    return np.array(found)


@dataclass(frozen=True)
class Names:
    """
    The names that are given.

    Attributes
    ----------
    explanation : Explanation
        The names.
    shares : Attribution
        Their shares of the gap.
    notes : tuple of str
        What a reader should know.

    """

    explanation: Explanation
    shares: Attribution
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, chosen: Chosen, unseen: Evidence | None, settings: DiagnosisSettings) -> Names:
        """
        Return what is given of the names of an explanation.

        They are stated in the model as given. Where they explain too little there, the
        explanation is that of a rigid body common to both days.

        """
        least = 0.0 if chosen.measured else settings.thresholds.headline
        found, notes = chosen.explanation, tuple[str, ...]()
        shares = shares_of(found, unseen, settings)
        if found.steps and shares.share(range(len(found.steps))) < least:
            found, remarks = as_bodies(found.in_common_body())
            shares, notes = shares_of(found, unseen, settings), (_COMMON, *remarks)
        while (gone := smallest(found, shares, settings, least)) is not None:
            found = found.without(gone)
            shares = shares_of(found, unseen, settings)
        return cls(found, shares, notes if found.steps else ())

    @property
    def share(self) -> float:
        """Return the share of the gap that all of them take."""
        return self.shares.share(range(len(self.explanation.steps)))

    @property
    def largest_share(self) -> float:
        """Return the same of the held-out data or of folds of the others, whichever is larger."""
        folds = self.shares.folds or self.shares
        return max(self.share, folds.share(range(len(self.explanation.steps))))

    def with_nothing_named(self, unseen: Evidence | None, settings: DiagnosisSettings) -> Names:
        """Return the same with all names in the small print."""
        found = self.explanation.with_nothing_named()
        return Names(found, shares_of(found, unseen, settings))


def smallest(
    explanation: Explanation, shares: Attribution, settings: DiagnosisSettings, least: float
) -> int | None:
    """
    Return the name of the smallest share that is small print; None if all are headline.

    A name is small print if its share is below `least`, in the data that it was found in as well,
    and no gap opens without it.

    """
    found = shares.folds or shares
    for k in sorted(range(len(explanation.steps)), key=lambda k: shares.share([k])):
        small = max(shares.share([k]), found.share([k])) < least
        if small and not _opens(explanation.without(k), explanation, settings):
            return k
    return None


def _opens(fewer: Explanation, explanation: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether some joint has a gap without a name (`fewer`), and none with it."""
    limits = explanation.evidence.limits(explanation.residual, settings)
    return bool(np.any((fewer.chi2_per_row > limits) & (explanation.chi2_per_row <= limits)))


def shares_of(
    explanation: Explanation, unseen: Evidence | None, settings: DiagnosisSettings
) -> Attribution:
    """Return shares of held-out data, or of folds where held-out data hardly show the names."""
    left_out = _left_out(explanation)
    if unseen is None:
        return left_out
    names = range(len(explanation.steps))
    seen = _predicted(explanation, left_out.order, unseen)
    shown = seen.share(names) > settings.thresholds.headline * left_out.share(names)
    return replace(seen, folds=left_out) if shown or not names else left_out
