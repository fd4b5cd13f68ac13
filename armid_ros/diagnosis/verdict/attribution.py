# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The share of the gap that each cause explains of held-out data, and which causes are the headline.

The gap is the sum of squares of the weighted residual of the model. Causes are added one by one,
the one with the largest gain first; intervals come from resampled blocks (bootstrap). The headline
has the causes that held-out data do not deny, and whose share is large enough.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import make_problem
from armid_ros.diagnosis.search.explanation import (
    as_bodies,
    Chosen,
    Explanation,
    in_model_as_given,
)
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.identification.fitting.identifiability import excludes_zero
from armid_ros.identification.fitting.normal_equations import informative_basis, NormalEquations
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

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
    denied : tuple of int
        Names that the held-out data deny, last of the order first; see `contradicts`.
    predicted : bool
        Whether it is of held-out data, and not of folds of the data that names were fitted to.
    folds : Attribution or None
        The same of these folds, where both were asked for; see `shares_of`.

    """

    order: tuple[int, ...]
    whole: FloatArray
    taken: FloatArray
    denied: tuple[int, ...] = ()
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
    left_out = _left_out(explanation)
    return left_out if unseen is None else _predicted(explanation, left_out.order, unseen)


@dataclass(frozen=True)
class _Folds:
    """
    The linear problem of a fitted arm, of which each fold is predicted from the others.

    Attributes
    ----------
    square, aim, power : ndarray, shape (B, f, f), (B, f), (B,)
        Products of all columns of each block with each other and with the residual that is left
        without any name, and of the latter with itself.
    fold : ndarray of int, shape (B,)
        Fold of each block.
    prior : NormalEquations
        Prior of all values.

    """

    square: FloatArray
    aim: FloatArray
    power: FloatArray
    fold: npt.NDArray[np.intp]
    prior: NormalEquations

    @classmethod
    def of(cls, explanation: Explanation) -> tuple[_Folds, list[int], list[list[int]]]:
        """Return the problem, its columns of no name, and those of the values of each name."""
        fitted, evidence = explanation.fitted, explanation.evidence
        first = len(fitted.change)
        named = [[first + k for k in values] for values, _ in fitted.places]
        problem = make_problem(
            evidence.data, evidence.sigma, fitted.residual, list(fitted.columns)
        )
        every = [column for own in named for column in own]
        values = fitted.estimate.values[[column - first for column in every]]
        y = problem.y + problem.x[:, :, every] @ values
        blocks = list(problem.blocks(problem.x, y))
        folds = cls(
            np.array([x.T @ x for x, _ in blocks]),
            np.array([x.T @ own for x, own in blocks]),
            np.array([own @ own for _, own in blocks]),
            problem.fold_of_block,
            fitted.prior,
        )
        return folds, list(range(first)), named

    def left(self, columns: Sequence[int]) -> FloatArray:
        """Return the held-out squares of each block beside some columns, shape (B,)."""
        index = list(columns)
        square, aim = self.square[:, index][:, :, index], self.aim[:, index]
        prior, result = self.prior.among(index), self.power.copy()
        for k in np.unique(self.fold):
            own, others = self.fold == k, self.fold != k
            basis = informative_basis(square[others].sum(axis=0) + prior.matrix)
            values = basis @ (basis.T @ (aim[others].sum(axis=0) + prior.vector))
            result[own] += (square[own] @ values - 2.0 * aim[own]) @ values
        return result


def _left_out(explanation: Explanation) -> Attribution:
    """Predict each fold from the others, adding the name with the largest gain at a time."""
    folds, free, named = _Folds.of(explanation)
    remaining, order = list(range(len(named))), list[int]()
    before = whole = folds.left(free)
    taken = np.zeros((len(named), len(whole)))
    while remaining:
        after = {k: folds.left([*free, *named[k]]) for k in remaining}
        best = min(remaining, key=lambda k: float(after[k].sum()))
        taken[best], before = before - after[best], after[best]
        free = [*free, *named[best]]
        order.append(best)
        remaining.remove(best)
    return Attribution(tuple(order), whole, taken)


def _predicted(explanation: Explanation, order: Sequence[int], unseen: Evidence) -> Attribution:
    """
    Predict held-out data with the first name, the first two, and so on, fitted to the data.

    Only joints in which a name acts can deny it: a body that is fitted jointly with it changes
    other joints as well.

    """
    arms = [explanation.reference.arm, *_staircase(explanation, order)]
    residuals = [unseen.residuals(arm) for arm in arms]
    squares = [unseen.block_squares(rows) for rows in residuals]
    taken = np.zeros((len(order), len(squares[0])))
    denied = []
    for position, k in enumerate(order):
        gain = squares[position] - squares[position + 1]
        steps = zip(residuals[position], residuals[position + 1], strict=True)
        made = unseen.block_squares([before - after for before, after in steps])
        own = _acts(explanation, k, unseen)
        taken[k] = gain.sum(axis=1)
        if contradicts((gain + made)[:, own].sum(axis=1) / 2.0, made[:, own].sum(axis=1)):
            denied.append(k)
    whole = squares[0].sum(axis=1)
    return Attribution(tuple(order), whole, taken, tuple(reversed(denied)), predicted=True)


def _acts(explanation: Explanation, name: int, evidence: Evidence) -> npt.NDArray[np.bool_]:
    """Return in which joints a name acts, shape (n,)."""
    own, arm = explanation.fitted.named[name], explanation.fitted.arm
    kept = list(own.kept)
    blocks = [part.columns(arm, own.effect)[:, :, kept] for part in evidence.data]
    return np.asarray(np.any([np.any(block, axis=(0, 2)) for block in blocks], axis=0))


def _staircase(explanation: Explanation, order: Sequence[int]) -> list[ArmModel]:
    """Return the arm with the first name, with the first two, and so on, each fitted."""
    fewer = [explanation.only(order[:count]) for count in range(1, len(order))]
    return [*(one.fitted.arm for one in fewer), explanation.fitted.arm] if order else []


@dataclass(frozen=True)
class Names:
    """
    The names that are given.

    Attributes
    ----------
    rest : Explanation
        The names, fitted jointly with a body common to both days where there is a baseline: its
        residual is what they leave.
    stated : Explanation
        The same in the model as given, whose values and gap are stated.
    shares : Attribution
        Shares of ``stated``.
    notes : tuple of str
        What a reader should know.

    """

    rest: Explanation
    stated: Explanation
    shares: Attribution
    notes: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, chosen: Chosen, unseen: Evidence | None, arm: ArmModel, settings: DiagnosisSettings
    ) -> Names:
        """
        Return what is given of the names of an explanation.

        Where recordings cannot tell a change from another motion's misfit, names have to explain
        most of the gap, in the recordings that they were found in or in those that were not used.

        """
        thresholds = settings.thresholds
        least = 0.0 if chosen.measured else thresholds.headline
        found, deny = chosen.rest or chosen.explanation, not chosen.tested
        rest, shares = _large(found, unseen, settings, least, deny)
        names = cls(rest, rest, shares)
        if chosen.rest is not None and rest.steps:
            as_described = chosen.explanation if rest is found else in_model_as_given(rest)
            names = _as_stated(names, as_described, unseen, arm, settings)
        steps = names.stated.steps
        if not (chosen.untested and steps):
            return names
        every, most = range(len(steps)), thresholds.open_share
        if names.shares.share(every) > most or attribute(names.stated, None).share(every) > most:
            return names
        return names.with_nothing_named(unseen, settings)

    def with_nothing_named(self, unseen: Evidence | None, settings: DiagnosisSettings) -> Names:
        """Return the same with all names in the small print."""
        rest, stated = (one.with_nothing_named() for one in (self.rest, self.stated))
        return Names(rest, stated, shares_of(stated, unseen, settings))


def _as_stated(
    names: Names,
    as_described: Explanation,
    unseen: Evidence | None,
    arm: ArmModel,
    settings: DiagnosisSettings,
) -> Names:
    """
    Return the names that stay in the model as given, where they are `as_described`.

    Where they explain too little there, the explanation keeps the rigid body common to both days.

    """
    rest, least = names.rest, settings.thresholds.headline
    alone = shares_of(as_described, unseen, settings)
    if alone.share(range(len(as_described.steps))) < least:
        bodily, remarks = as_bodies(rest, arm)
        return replace(names, stated=bodily, notes=(_COMMON, *remarks))
    small = smallest(as_described, alone, settings, least)
    if small is None:
        return replace(names, stated=as_described, shares=alone)
    fewer = rest.without(small)
    kept = Names(fewer, fewer, shares_of(fewer, unseen, settings))
    if not fewer.steps:
        return kept
    return _as_stated(kept, in_model_as_given(fewer), unseen, arm, settings)


def _large(
    explanation: Explanation,
    unseen: Evidence | None,
    settings: DiagnosisSettings,
    least: float,
    deny: bool,
) -> tuple[Explanation, Attribution]:
    """
    Move names that held-out data deny, and small ones, out of the headline; return the shares.

    Shares are of the held-out data, or of folds of the fitted data if the former hardly show what
    was named. A test of changes has asked the held-out data already, and knows that a misfit
    differs between motions: the misfit of one motion alone denies nothing (`deny`).

    """
    shares = shares_of(explanation, unseen, settings)
    denied = shares.denied if deny else ()
    gone = denied[0] if denied else smallest(explanation, shares, settings, least)
    if gone is None:
        return explanation, shares
    return _large(explanation.without(gone), unseen, settings, least, deny)


def smallest(
    explanation: Explanation, shares: Attribution, settings: DiagnosisSettings, least: float
) -> int | None:
    """
    Return the name of the smallest share that is small print; None if all are headline.

    A name is small print if all of its values may be zero and it does not explain most of the gap,
    or if its share is below `least`, in the data that it was found in as well, and no gap opens
    without it.

    """
    found = shares.folds or shares
    for k in sorted(range(len(explanation.steps)), key=lambda k: shares.share([k])):
        most = shares.share([k]) > settings.thresholds.open_share
        if not most and may_be_zero(explanation, k):
            return k
        small = max(shares.share([k]), found.share([k])) < least
        if small and not _opens(explanation.without(k), explanation, settings):
            return k
    return None


def _opens(fewer: Explanation, explanation: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether some joint has a gap without a name (`fewer`), and none with it."""
    if explanation.prior is not None:
        fewer, explanation = in_model_as_given(fewer), in_model_as_given(explanation)
    limits = explanation.evidence.limits(explanation.fitted.residual, settings)
    return bool(np.any((fewer.chi2_per_row > limits) & (explanation.chi2_per_row <= limits)))


def shares_of(
    explanation: Explanation, unseen: Evidence | None, settings: DiagnosisSettings
) -> Attribution:
    """Return shares of held-out data, or of folds where held-out data hardly show the names."""
    left_out = attribute(explanation, None)
    if unseen is None:
        return left_out
    names = range(len(explanation.steps))
    seen = attribute(explanation, unseen)
    shown = seen.share(names) > settings.thresholds.headline * left_out.share(names)
    if shown or not names:
        return replace(seen, folds=left_out)
    return replace(left_out, denied=seen.denied)


def may_be_zero(explanation: Explanation, name: int) -> bool:
    """
    Return whether the 95 % interval of every value of a name contains zero.

    Shapes do not count: they say how a cause acts, and not whether. The intervals are conditional
    on the shapes that were found: a drift may be slow and large or fast and small, and there in
    either case.

    """
    fitted = explanation.fitted
    values, shapes = fitted.places[name]
    span = np.arange(values.start, shapes.stop)
    variance = np.diag(fitted.estimate.covariance)
    known = span[np.isfinite(variance[span])]
    precision = np.linalg.pinv(fitted.estimate.covariance[np.ix_(known, known)], hermitian=True)
    asked = known < values.stop
    at_shapes = np.linalg.pinv(precision[np.ix_(asked, asked)], hermitian=True)
    deviation = np.sqrt(np.diag(at_shapes))
    return not np.any(excludes_zero(fitted.estimate.values[known[asked]], deviation))


def contradicts(cross: FloatArray, square: FloatArray) -> bool:
    """
    Return whether data deny a cause: they follow it no more than noise would.

    The slope of the residual on the prediction of the cause is one for a cause, zero for none.
    Data in which it does nothing do not deny it: the standard deviation of the slope comes from
    the scatter between blocks, and is no less than for white noise.

    Parameters
    ----------
    cross, square : ndarray, shape (B,)
        x'r and x'x of every block, of the prediction x and the residual r.

    """
    made = float(square.sum())
    if made <= 0.0:
        return False
    slope = float(cross.sum()) / made
    wide = 2.0 * float(np.sqrt(max(np.sum((cross - slope * square) ** 2), made))) / made
    return slope + wide < 1.0 and slope - wide <= 0.0
