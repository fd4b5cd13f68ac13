# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which group explains what is left, scored on parts of the data it was not fitted to.

The rigid body and all that was accepted before are free throughout. The values of a group come
from all parts of the data but one, and are judged by how much of that one's excess they take.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.diagnosis.candidates import Group
from armid_ros.diagnosis.problem import Problem, Projection
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

#: A gain in rows too few for blocks to repeat, such as at the peaks where a drive saturates, is
#: sure when it is this large in each half of a trajectory; noise alone gives some ten.
SPARSE_GAIN = 50.0
#: Columns of which one part of the data has more than this share do nothing in the others, and
#: nothing can be learned of them there: halves of that part are held out instead.
_IN_ONE_PART = 0.999
#: Parts of the data that count together as well, where all agree.
_MANY = 4
#: Values beyond a bound by this share of it are at the bound.
_AT_BOUND = 0.1


@dataclass(frozen=True)
class Score:
    """
    How well a group explains what is left.

    Attributes
    ----------
    group : Group
        The group.
    values : ndarray, shape (p,)
        Its values fitted to all parts.
    std : ndarray, shape (p,)
        Their standard deviations, as far as white noise goes.
    gain : float
        Sum of squares that the parts lose with values from the other parts.
    visible : float
        Share of the columns that the free ones cannot make.

    """

    group: Group
    values: FloatArray
    std: FloatArray
    gain: float
    visible: float


@dataclass(frozen=True)
class Trial:
    """
    A group looked at row by row.

    Attributes
    ----------
    score : Score
        Its values.
    torque : ndarray, shape (R, n)
        What it explains with values from all data, over noise, free columns taken out.
    held_out : ndarray, shape (R, n)
        The same with values from the other parts.
    gains : ndarray, shape (F, n)
        Sum of squares that each part and joint loses, held out.
    z : ndarray, shape (F,)
        How sure the gain of each part is.
    blocks : ndarray, shape (F, B)
        Sum of squares that each block of each part loses, held out.
    fold_values : ndarray, shape (F, p)
        Values without each part.
    only : int or None
        The one part of the data in which the columns do something, if there is but one; then its
        halves are the parts that values are not taken from.
    losses : ndarray, shape (n,)
        Loss of each joint without what is explained.

    """

    score: Score
    torque: FloatArray
    held_out: FloatArray
    gains: FloatArray
    z: FloatArray
    blocks: FloatArray
    fold_values: FloatArray
    only: int | None
    losses: FloatArray

    @property
    def gain(self) -> float:
        """Held-out gain over all parts and joints."""
        return float(self.gains.sum())


def screen(
    problem: Problem, projection: Projection, groups: Sequence[Group], least_visible: float
) -> list[Score]:
    """
    Score all groups of which something is visible, best first.

    Columns of the groups count from the beginning of the problem.

    """
    left = projection.sweep(problem.products)
    whole, rest = np.diagonal(problem.products.sum(axis=0)), left.sum(axis=0)
    result = []
    for group in groups:
        span = group.columns
        parts, target = left[:, span, span], left[:, span, -1]
        own, aim = rest[span, span], rest[span, -1]
        size = float(whole[span].sum())
        visible = float(np.sqrt(max(np.trace(own), 0.0) / size)) if size > 0.0 else 0.0
        if visible < least_visible:
            continue
        held = np.diag(group.precision)
        values, std = solve_products(own + held, aim)
        gain = float(2.0 * values @ aim - values @ own @ values)
        raw = np.trace(problem.products[:, span, span], axis1=1, axis2=2)
        if _only_part(raw) is None:
            gain = 0.0
            for a, b in zip(parts, target, strict=True):
                v, _ = solve_products(own + held - a, aim - b)
                gain += float(2.0 * v @ b - v @ a @ v)
        result.append(Score(group, values, std, gain, visible))
    return sorted(result, key=lambda score: -score.gain)


def _only_part(sizes: FloatArray) -> int | None:
    """Return the one part of the data that has columns with squares of these sums, if one has."""
    largest = int(np.argmax(sizes))
    return largest if sizes[largest] > _IN_ONE_PART * sizes.sum() else None


def solve_products(own: FloatArray, aim: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve normal equations; directions that the data do not tell stay at zero."""
    diagonal = np.diag(own)
    if len(aim) == 1 and diagonal[0] > 0.0:
        return aim / diagonal, 1.0 / np.sqrt(diagonal)
    seen = diagonal > 1e-9 * max(float(diagonal.max()), 1e-300)
    scale = np.where(seen, 1.0 / np.sqrt(np.where(seen, diagonal, 1.0)), 0.0)
    values, vectors = np.linalg.eigh(own * np.outer(scale, scale))
    good = values > 1e-5 * max(float(values[-1]), 1e-300)
    basis = scale[:, np.newaxis] * vectors[:, good] / np.sqrt(values[good])
    return basis @ (basis.T @ aim), np.sqrt(np.sum(basis**2, axis=1))


def try_group(
    problem: Problem,
    projection: Projection,
    score: Score,
    columns: FloatArray,
    settings: DiagnosisSettings,
) -> Trial:
    """Look at a group row by row; columns are weighted, (R, n, p), free ones not taken out."""
    left = projection.rest(problem.y)
    own_columns = projection.rest(columns)
    sizes = np.bincount(problem.fold, np.sum(columns**2, axis=(1, 2)))
    only = _only_part(np.asarray(sizes, dtype=np.float64))
    piece = problem.fold if only is None else _halves(problem.fold == only)
    held = [(own_columns[piece == k], left[piece == k]) for k in range(int(piece.max()) + 1)]
    parts = np.array([np.einsum('rnp,rnq->pq', c, c) for c, _ in held])
    aims = np.array([np.einsum('rnp,rn->p', c, y) for c, y in held])
    own, aim = parts.sum(axis=0) + np.diag(score.group.precision), aims.sum(axis=0)
    values, std = solve_products(own, aim)
    fold_values = np.array(
        [solve_products(own - a, aim - b)[0] for a, b in zip(parts, aims, strict=True)]
    )
    held_out = np.einsum('rnp,rp->rn', own_columns, fold_values[piece])
    gain = left**2 - (left - held_out) ** 2
    gains = np.array([gain[problem.fold == k].sum(axis=0) for k in range(problem.folds)])
    scored = Score(score.group, values, std, float(gains.sum()), score.visible)
    z = block_z(problem.fold, gain.sum(axis=1), settings.blocks)
    z = sure_of_few_rows(z, _lesser_half(problem.fold, gain.sum(axis=1)), settings)
    blocks = block_sums(problem.fold, gain.sum(axis=1), settings.blocks)
    torque = own_columns @ values
    losses = joint_losses(problem, left - torque)
    return Trial(scored, torque, held_out, gains, z, blocks, fold_values, only, losses)


def _halves(where: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
    """Return 1 and 2 for the rows of both halves of a part of the data, 0 for others."""
    rows = np.cumsum(where)
    return np.where(where, 1 + (2 * rows > rows[-1]), 0)


def block_sums(fold: npt.NDArray[np.intp], gain: FloatArray, blocks: int) -> FloatArray:
    """Return the sums of a gain per row in the blocks of each fold, shape (F, blocks)."""
    parts = [np.array_split(gain[fold == k], blocks) for k in range(int(fold.max()) + 1)]
    return np.array([[block.sum() for block in part] for part in parts])


def block_z(fold: npt.NDArray[np.intp], gain: FloatArray, blocks: int) -> FloatArray:
    """
    Return how sure it is that a gain per row is positive, in each fold, shape (F,).

    Blocks are long enough to be independent of each other, whatever the colour of the residual.

    """
    z = np.zeros(int(fold.max()) + 1)
    for k in range(len(z)):
        means = np.array([part.mean() for part in np.array_split(gain[fold == k], blocks)])
        spread = float(means.std(ddof=1)) / np.sqrt(len(means))
        z[k] = means.mean() / max(spread, 1e-300) if means.any() else 0.0
    return z


def sure_of_few_rows(
    z: FloatArray, lesser_half: FloatArray, settings: DiagnosisSettings
) -> FloatArray:
    """Return the z of folds, beyond doubt where a gain of few rows comes in both halves."""
    sure = np.maximum(z, 1.5 * settings.least_z)
    return np.where(lesser_half > SPARSE_GAIN, sure, z)


def _lesser_half(fold: npt.NDArray[np.intp], gain: FloatArray) -> FloatArray:
    """Return the gain of that half of each fold which gains less, shape (F,)."""
    halves = [np.array_split(gain[fold == k], 2) for k in range(int(fold.max()) + 1)]
    return np.array([min(part.sum() for part in pair) for pair in halves])


def excess(problem: Problem, left: FloatArray) -> FloatArray:
    """Return the sum of squares beyond the noise of each fold and joint, shape (F, n)."""
    return np.asarray(np.maximum(problem.losses(left) - 1.0, 0.0) * problem.count())


def joint_losses(problem: Problem, left: FloatArray) -> FloatArray:
    """Return the loss of each joint over all folds, shape (n,)."""
    count = problem.used.sum(axis=0)
    return np.asarray(np.sum(left**2, axis=0) / np.maximum(count, 1))


def within_bounds(score: Score) -> bool:
    """Return whether the values are physically possible, or differ from that by noise."""
    kept = list(score.group.kept)
    lower, upper = (bound[kept] for bound in score.group.effect.bounds())
    slack = [
        3.0 * score.std + _AT_BOUND * np.where(np.isfinite(bound), np.abs(bound), 0.0)
        for bound in (lower, upper)
    ]
    return bool(
        np.all(score.values > lower - slack[0]) and np.all(score.values < upper + slack[1])
    )


def replicated(trial: Trial, settings: DiagnosisSettings) -> bool:
    """
    Return whether a gain is there in more than one part of the data.

    In two parts clearly; or in one beyond all doubt, the fast one as a rule, with another that
    agrees and none that disagrees; or beyond all doubt in the only one that can show it; or beyond
    all doubt in many together of which each agrees, short ones as a rule. The values never come
    from the part that is judged.

    """
    if trial.only is not None:
        return bool(trial.z[trial.only] >= 1.5 * settings.least_z)
    order = np.sort(trial.z)[::-1]
    if len(order) < 2:
        return bool(order[0] >= settings.least_z)
    carried = order[0] >= 1.5 * settings.least_z and order[1] >= 0.5 * settings.least_z
    carried &= order[-1] > -settings.rival_z
    together = len(order) >= _MANY and order.sum() >= 1.5 * settings.least_z * len(order) ** 0.5
    agreed = together and order[-1] >= 0.5 * settings.least_z
    return bool(order[1] >= settings.least_z or carried or agreed)


def of_the_gap(trial: Trial, total: FloatArray, settings: DiagnosisSettings) -> bool:
    """Return whether a gain is a part of the first gap, or of that of a joint that had much."""
    if trial.gain > settings.least_of_all * total.sum():
        return True
    much = total >= settings.least_of_joint * total.sum()
    return bool(np.any(much & (trial.gains.sum(axis=0) > settings.least_of_joint * total)))


def acceptable(
    trial: Trial,
    problem: Problem,
    left: FloatArray,
    settings: DiagnosisSettings,
    total: FloatArray | None = None,
) -> bool:
    """
    Return whether a group is possible, replicated, and closes a real share of the gap.

    Parameters
    ----------
    total : ndarray, shape (n,), optional
        Excess of each joint before anything was named.

    """
    if trial.gain <= 0.0 or not within_bounds(trial.score) or not replicated(trial, settings):
        return False
    gap = joint_losses(problem, left) > settings.consistent_loss
    beyond, gains = excess(problem, left).sum(axis=0), trial.gains.sum(axis=0)
    rest = bool(np.any(gap & (gains >= settings.most_of_rest * beyond)))
    if total is not None and not rest and not of_the_gap(trial, total, settings):
        return False
    single = len(trial.score.values) == 1
    if single and np.any(trial.fold_values[:, 0] * trial.score.values[0] < 0.0):
        return False
    whole = trial.gain >= settings.least_share * beyond[gap].sum() and gains[gap].sum() > 0.0
    one = bool(np.any(gap & (gains >= 0.3 * beyond)))
    everywhere = len(trial.z) >= 3 and bool(np.all(trial.z >= settings.sure_z))
    pooled = everywhere and trial.gain >= 0.3 * beyond.sum()
    return (bool(gap.any()) and (whole or one)) or pooled
