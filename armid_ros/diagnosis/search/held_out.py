# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What every group explains of data that its values were not fitted to.

All that is free is fitted together with a group to all parts of the data but one, and both
predict the part that was left out. What the group adds to that prediction, x, is compared with
what is left without it, r: the squares that go are 2 x'r - x'x, and the slope of r on x is one for
a cause and zero for what follows noise. Both are known block by block, so that their intervals
hold whatever the colour of the residual.

All of it is algebra on products of columns, a small matrix for each block.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from armid_ros.diagnosis.data.rows import Problem
from armid_ros.diagnosis.search.candidates import Group
from armid_ros.diagnosis.search.products import Products, products
from armid_ros.identification.fitting.normal_equations import informative_basis
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import stats

#: Directions of which the free columns leave less than this share of their squares are not seen.
_UNSEEN = 1e-10
#: Squares over noise of columns that are rounding, whatever the units.
_NOTHING = 1e-100

#: Squares that differ by less than this share do so by rounding.
ROUNDING = 1e-6
#: Recordings hardly show what takes less than this share of the share it takes of others.
HARDLY = 0.1


def denies(cross: FloatArray, square: FloatArray) -> bool:
    """
    Return whether data deny a cause: no more follows it than noise would.

    The slope of what is left on what the cause predicts is one for a cause, zero for none. Data
    in which it does nothing do not deny it.

    Parameters
    ----------
    cross, square : ndarray, shape (B,)
        x'r and x'x of every block, of what is predicted (x) and what is left (r).

    """
    made = float(square.sum())
    if made <= 0.0:
        return False
    slope = float(cross.sum()) / made
    wide = 2.0 * float(np.sqrt(np.sum((cross - slope * square) ** 2))) / made
    return slope + wide < 1.0 and slope - wide <= 0.0


@dataclass(frozen=True)
class Trial:
    """
    A group and how it predicts what it was not fitted to.

    Attributes
    ----------
    group : Group
        The group.
    values, std : ndarray, shape (p,)
        Its values fitted to all of the data, and their deviations as far as white noise goes.
    visible : float
        Share of the columns that the free ones cannot make.
    freedom : float
        Values that the data choose; those held by what is expected of them count in part.
    cross, square : ndarray, shape (B,)
        x'r and x'x of every block.
    held_values : ndarray, shape (K, p)
        Values without each part.
    held_free : ndarray, shape (K, f)
        The free values without each part, changed by the group, and ``held_alone`` without it.
    piece : ndarray of int, shape (B,)
        The part that each block is left out with.

    """

    group: Group
    values: FloatArray
    std: FloatArray
    visible: float
    freedom: float
    cross: FloatArray
    square: FloatArray
    held_values: FloatArray
    held_free: FloatArray
    held_alone: FloatArray
    piece: npt.NDArray[np.intp]

    @cached_property
    def deviation(self) -> FloatArray:
        """Deviations of the values, those of noise of any colour by the jackknife, shape (p,)."""
        parts = len(self.held_values)
        change = self.held_values - self.held_values.mean(axis=0)
        return np.asarray(np.sqrt(self.std**2 + (1.0 - 1.0 / parts) * np.sum(change**2, axis=0)))

    @property
    def gains(self) -> FloatArray:
        """Squares that go in every block, shape (B,)."""
        return np.asarray(2.0 * self.cross - self.square)

    @cached_property
    def gain(self) -> float:
        """Squares over noise that go in all of the data."""
        return float(self.gains.sum())

    @cached_property
    def slope(self) -> float:
        """Slope of what is left on what is predicted: one for a cause, zero for noise."""
        return float(self.cross.sum() / max(float(self.square.sum()), 1e-300))

    @cached_property
    def z(self) -> float:
        """
        Return the slope over its deviation.

        That is what blocks differ by, and no less than white noise makes: a cause that acts in two
        blocks may do so alike by chance.

        """
        scatter = self.cross - self.slope * self.square
        count = len(scatter)
        variance = float(np.sum(scatter**2)) * count / (count - 1)
        variance = max(variance, float(self.square.sum()))
        return float(self.cross.sum() / max(np.sqrt(variance), 1e-300))

    @property
    def p(self) -> float:
        """Probability of such a slope if the group did nothing."""
        return float(stats.t.sf(self.z, len(self.cross) - 1))

    @property
    def replicated(self) -> int:
        """Parts of the data that lose squares."""
        return int(np.sum(np.bincount(self.piece, self.gains) > 0.0))

    def left_out(
        self, problem: Problem, own: FloatArray, beside: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """
        Return what the others tell wrong of each piece without the group and with it, each (R, n).

        Parameters are those of `joint_gains`.

        """
        piece = self.piece[problem.block]
        alone, rest = np.empty_like(problem.y), np.empty_like(problem.y)
        for part in range(len(self.held_values)):
            rows = piece == part
            alone[rows] = problem.y[rows] - beside[rows] @ self.held_alone[part]
            predicted = own[rows] @ self.held_values[part] + beside[rows] @ self.held_free[part]
            rest[rows] = problem.y[rows] - predicted
        return alone, rest

    def joint_gains(self, problem: Problem, own: FloatArray, beside: FloatArray) -> FloatArray:
        """
        Return the squares that go in every joint, shape (n,).

        What the group spares the data that hold the free values is shared out among the joints.

        Parameters
        ----------
        problem : Problem
            The rows.
        own : ndarray, shape (R, n, p)
            Columns of the group.
        beside : ndarray, shape (R, n, f)
            Columns that were free.

        """
        alone, rest = self.left_out(problem, own, beside)
        gains = np.sum(alone**2 - rest**2, axis=0)
        seen = float(gains.sum())
        return np.asarray(gains * max(self.gain / seen, 1.0) if seen > 0.0 else gains)


def lead(first: Trial, other: Trial) -> tuple[float, float]:
    """Return by how many squares one trial is ahead of another, and that over its deviation."""
    difference = first.gains - other.gains
    spread = float(difference.std(ddof=1)) * np.sqrt(len(difference))
    return float(difference.sum()), float(difference.sum()) / max(spread, 1e-300)


@dataclass(frozen=True)
class _Base:
    """What is free, fitted to some blocks."""

    inverse: FloatArray
    theta: FloatArray
    border: FloatArray
    solved: FloatArray

    @classmethod
    def of(
        cls, known: Products, train: npt.NDArray[np.bool_], hold: FloatArray, pull: FloatArray
    ) -> _Base:
        own = known.free[train].sum(axis=0) + hold
        basis = informative_basis(own)
        inverse = basis @ basis.T
        border = known.border[train].sum(axis=0)
        return cls(
            inverse, inverse @ (known.aim[train].sum(axis=0) + pull), border, inverse @ border
        )


@dataclass(frozen=True)
class _Part:
    """
    A part that is held out.

    Attributes
    ----------
    test : ndarray of int, shape (b,)
        Its blocks, and ``train``, of bool, shape (B,), all others.
    base : _Base
        What is free, fitted to the others.
    left : ndarray, shape (b, f)
        Of the free columns with what that leaves.
    target : ndarray, shape (b, C)
        Of the columns of the groups with what that leaves.
    spared : ndarray, shape (b, f, C)
        Of the free columns with what the others make of those of the groups.

    """

    test: npt.NDArray[np.intp]
    train: npt.NDArray[np.bool_]
    base: _Base
    left: FloatArray
    target: FloatArray
    spared: FloatArray

    @classmethod
    def of(
        cls, known: Products, train: npt.NDArray[np.bool_], hold: FloatArray, pull: FloatArray
    ) -> _Part:
        base, test = _Base.of(known, train, hold, pull), np.flatnonzero(~train)
        free, border = known.free[test], known.border[test]
        left = known.aim[test] - free @ base.theta
        target = known.target[test] - base.theta @ border
        return cls(test, train, base, left, target, free @ base.solved)


def held_out(
    problem: Problem,
    free: Sequence[int],
    groups: Sequence[Group],
    hold: FloatArray,
    pull: FloatArray,
    whole: bool = True,
) -> tuple[list[Trial], FloatArray]:
    """
    Try every group beside what is free.

    Parameters
    ----------
    problem : Problem
        Rows; columns of the groups come first.
    free : sequence of int
        Columns that are fitted beside.
    groups : sequence of Group
        What is tried.
    hold : ndarray, shape (f, f)
        Precision that free values are held with.
    pull : ndarray, shape (f,)
        What they are held to, times that.
    whole : bool
        Whether what holds the free values counts as data: what a group spares them there is a
        gain as well.

    Returns
    -------
    trials : list of Trial
        In the order of the groups; those of which nothing is visible are left out.
    power : ndarray, shape (B,)
        Held-out squares without any of them.

    """
    return tried_beside(products(problem, free, groups), problem, groups, hold, pull, whole)


def tried_beside(
    known: Products,
    problem: Problem,
    groups: Sequence[Group],
    hold: FloatArray,
    pull: FloatArray,
    whole: bool = True,
) -> tuple[list[Trial], FloatArray]:
    """Try every group, of which products are known; see `held_out`."""
    every = np.ones(len(known.power), dtype=bool)
    folding = problem.fold_of_block
    everything = _Base.of(known, every, hold, pull)
    parts = [_Part.of(known, folding != k, hold, pull) for k in range(folding.max() + 1)]
    power = _left(known, [part.base for part in parts], folding)
    counted = (hold, pull) if whole else (np.zeros_like(hold), np.zeros_like(pull))
    trials = [
        _tried(known, group, k, everything, parts, folding, counted)
        for k, group in enumerate(groups)
    ]
    return [trial for trial in trials if trial is not None], power


def _left(known: Products, bases: Sequence[_Base], folding: npt.NDArray[np.intp]) -> FloatArray:
    """Return the held-out squares of every block beside what is free alone."""
    theta = np.array([base.theta for base in bases])[folding]  # of what is not held out: unused
    return np.asarray(
        known.power
        - 2.0 * np.einsum('bf,bf->b', theta, known.aim)
        + np.einsum('bf,bfg,bg->b', theta, known.free, theta)
    )


def _tried(
    known: Products,
    group: Group,
    position: int,
    everything: _Base,
    parts: Sequence[_Part],
    folding: npt.NDArray[np.intp],
    counted: tuple[FloatArray, FloatArray],
) -> Trial | None:
    span, own = group.columns, known.own[position]
    hold = np.diag(group.precision)
    border, target = known.border[:, :, span], known.target[:, span]
    whole = own.sum(axis=0)
    rest = whole - everything.border[:, span].T @ everything.solved[:, span]
    size = float(np.trace(whole))
    visible = float(np.sqrt(max(np.trace(rest), 0.0) / size)) if size > _NOTHING else 0.0
    if visible < 1e-5:
        return None
    aim = target.sum(axis=0) - everything.border[:, span].T @ everything.theta
    inverse = _inverse(rest + hold, whole)
    values = inverse @ aim
    cross, square = np.zeros((2, len(folding)))
    held_values, held_free = [], []
    for part in parts:
        test, base = part.test, part.base
        solved = base.solved[:, span]
        seen = own[part.train].sum(axis=0) - base.border[:, span].T @ solved + hold
        aim = target[part.train].sum(axis=0) - base.border[:, span].T @ base.theta
        v = _inverse(seen, whole) @ aim
        change = -solved @ v
        made = border[test] @ v
        cross[test] = part.target[:, span] @ v + part.left @ change
        square[test] = (own[test] @ v) @ v + (2.0 * made - part.spared[:, :, span] @ v) @ change
        share = 1.0 / (len(parts) * max(len(test), 1))
        cross[test] += share * change @ (counted[1] - counted[0] @ base.theta)
        square[test] += share * change @ counted[0] @ change
        held_values.append(v)
        held_free.append(base.theta + change)
    return Trial(
        group,
        values,
        np.sqrt(np.maximum(np.diag(inverse), 0.0)),
        visible,
        float(np.trace(rest @ inverse)),
        cross,
        square,
        np.array(held_values),
        np.array(held_free),
        np.array([part.base.theta for part in parts]),
        folding,
    )


def _inverse(own: FloatArray, whole: FloatArray) -> FloatArray:
    """Invert products; directions that the data do not tell stay at zero."""
    diagonal = np.diag(whole)
    if len(own) == 1:
        return np.array([[1.0 / own[0, 0]]]) if own[0, 0] > _UNSEEN * whole[0, 0] else 0.0 * own
    seen = diagonal > 1e-9 * max(float(diagonal.max()), 1e-300)
    scale = np.where(seen, 1.0 / np.sqrt(np.where(seen, diagonal, 1.0)), 0.0)
    values, vectors = np.linalg.eigh(own * np.outer(scale, scale))
    good = values > 1e-6 * max(float(values[-1]), 1e-300)
    basis = scale[:, np.newaxis] * vectors[:, good] / np.sqrt(values[good])
    return np.asarray(basis @ basis.T)
