# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A candidate, its trial on held-out data, and how it was accepted.

A candidate is an effect on certain joints with one shape. Its trial is what it explains of data
that its values were not fitted to; see `held_out`.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeAlias

from armid_ros.diagnosis.data.rows import each_times
from armid_ros.effects import Effect
from armid_ros.identification.fitting.normal_equations import jackknife
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt
from scipy import stats

#: Name, joints and kept values of a candidate.
Key: TypeAlias = tuple[str, tuple[str, ...], tuple[int, ...]]
#: Least resolution of an identifiable value: two that data do not separate have a half or less.
IDENTIFIABLE = 0.9
#: Relative difference of squares below which it is rounding.
ROUNDING = 1e-6


@dataclass(frozen=True)
class SelectedEffect:
    """
    A named effect, as it is fitted.

    Attributes
    ----------
    effect : Effect
        Joints and shape.
    kept : tuple of int
        Its parameters that are fitted; the others are zero.

    """

    effect: Effect
    kept: tuple[int, ...]


@dataclass(frozen=True)
class Candidate:
    """
    An effect on certain joints, with a shape, and where its columns are.

    Attributes
    ----------
    effect : Effect
        Joints and shape included.
    columns : slice
        Its columns among those of all candidates.
    kept : tuple of int
        Parameters of the effect that the columns belong to; the others are zero.
    robot : Robot
        What the effect acts on.
    found : tuple of ndarray, each (P,), or None
        Estimates of its values and their standard deviations: one value may limit the prior of
        others.

    """

    effect: Effect
    columns: slice
    kept: tuple[int, ...]
    robot: Robot
    found: tuple[FloatArray, FloatArray] | None = None

    @cached_property
    def precision(self) -> FloatArray:
        """Prior precision of the values, about zero, shape (p,)."""
        return self.effect.spread(self.robot, self.found)[list(self.kept)] ** -2.0

    def as_found(self, values: FloatArray, std: FloatArray) -> Candidate:
        """Return the candidate with estimates of its values and their deviations, each (p,)."""
        size = len(self.effect.parameters(self.robot))
        whole, deviation = np.zeros(size), np.full(size, np.inf)
        whole[list(self.kept)], deviation[list(self.kept)] = values, std
        return replace(self, found=(whole, deviation))

    @property
    def key(self) -> Key:
        """Name, joints and quantities: candidates of one key differ in their shape."""
        return self.effect.name, self.effect.joints, self.kept

    @property
    def size(self) -> int:
        """Return the number of its columns."""
        return int(self.columns.stop) - int(self.columns.start)


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


@dataclass(frozen=True)
class Trial:
    """
    The held-out result of a candidate.

    Attributes
    ----------
    candidate : Candidate
        The candidate.
    values, std : ndarray, shape (p,)
        Its values fitted to all of the data, and their standard deviations for white noise.
    resolution : ndarray, shape (p,)
        Diagonal of the resolution matrix: one where the data determine a value, zero where only
        the prior does (Menke, Geophysical Data Analysis, 1989).
    visible : float
        Share of the length of its columns that the nuisance columns cannot reproduce.
    cross, square : ndarray, shape (B,)
        x'r and x'x of every block; see `held_out`.
    fold_values, fold_std : ndarray, shape (K, p)
        Values fitted without each fold, and their standard deviations for white noise.
    fold_free : ndarray, shape (K, f)
        Nuisance parameters fitted without each fold, jointly with the candidate, and
        ``fold_alone`` without it.
    fold : ndarray of int, shape (B,)
        Fold of each block.

    """

    candidate: Candidate
    values: FloatArray
    std: FloatArray
    resolution: FloatArray
    visible: float
    cross: FloatArray
    square: FloatArray
    fold_values: FloatArray
    fold_std: FloatArray
    fold_free: FloatArray
    fold_alone: FloatArray
    fold: npt.NDArray[np.intp]

    @property
    def freedom(self) -> float:
        """Return the number of values that the data determine; the prior holds some in part."""
        return float(self.resolution.sum())

    @cached_property
    def deviation(self) -> FloatArray:
        """Return the standard deviations of the values, coloured noise included, shape (p,)."""
        coloured = jackknife(self.values, self.std, self.fold_values, self.fold_std)
        return np.asarray(np.sqrt(self.std**2 + coloured))

    @property
    def gains(self) -> FloatArray:
        """Reduction of the held-out squares of every block, shape (B,)."""
        return np.asarray(2.0 * self.cross - self.square)

    @cached_property
    def gain(self) -> float:
        """Reduction of the weighted held-out squares of all data."""
        return float(self.gains.sum())

    @cached_property
    def slope(self) -> float:
        """Slope of the residual on the prediction: one for a cause, zero for noise."""
        return float(self.cross.sum() / max(float(self.square.sum()), 1e-300))

    @cached_property
    def z(self) -> float:
        """
        Return the slope over its standard deviation.

        The latter comes from the scatter between blocks, and is no less than for white noise: a
        cause that acts in two blocks may act alike in both by chance.

        """
        scatter = self.cross - self.slope * self.square
        count = len(scatter)
        variance = float(np.sum(scatter**2)) * count / (count - 1)
        variance = max(variance, float(self.square.sum()))
        return float(self.cross.sum() / max(np.sqrt(variance), 1e-300))

    @property
    def p(self) -> float:
        """Probability of such a slope if the candidate did nothing."""
        return float(stats.t.sf(self.z, len(self.cross) - 1))

    @property
    def replicated(self) -> int:
        """Return the number of folds with a gain."""
        return int(np.sum(np.bincount(self.fold, self.gains) > 0.0))

    def left_out(
        self, y: FloatArray, block: npt.NDArray[np.intp], own: FloatArray, free: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """
        Return the held-out residual without the candidate and with it, each (R, n).

        Parameters are those of `joint_gains`.

        """
        fold = self.fold[block]
        alone = y - each_times(free, self.fold_alone[fold])
        rest = y - each_times(own, self.fold_values[fold]) - each_times(free, self.fold_free[fold])
        return alone, rest

    def joint_gains(
        self, y: FloatArray, block: npt.NDArray[np.intp], own: FloatArray, free: FloatArray
    ) -> FloatArray:
        """
        Return the gain in every joint, shape (n,).

        A gain by better agreement of the nuisance parameters with their prior is divided among the
        joints.

        Parameters
        ----------
        y : ndarray, shape (R, n)
            Residual to be explained, over the unit of the gap.
        block : ndarray of int, shape (R,)
            Block of each row.
        own : ndarray, shape (R, n, p)
            Columns of the candidate.
        free : ndarray, shape (R, n, f)
            Nuisance columns.

        """
        alone, rest = self.left_out(y, block, own, free)
        gains = np.sum(alone**2 - rest**2, axis=0)
        seen = float(gains.sum())
        return np.asarray(gains * max(self.gain / seen, 1.0) if seen > 0.0 else gains)


def lead(first: Trial, other: Trial) -> tuple[float, float]:
    """Return the lead in gain of one trial over another, and that over its standard deviation."""
    difference = first.gains - other.gains
    spread = float(difference.std(ddof=1)) * np.sqrt(len(difference))
    return float(difference.sum()), float(difference.sum()) / max(spread, 1e-300)


@dataclass(frozen=True)
class Step:
    """
    One name that was accepted.

    Attributes
    ----------
    trial : Trial
        What it explains.
    rivals : tuple of Trial
        Candidates that the data do not exclude in its place.
    ranking : tuple of Trial
        The best candidates of the round, one per name and joints, best first.
    total : float
        Held-out squares that shares are of.
    tried : int
        Candidates that were tried, every shape for itself.
    misfit_share : float
        Share of the misfit that it has to take: zero where recordings tell a change from another
        motion's misfit. None for friction and offsets without given values, which only have to be
        significant.

    """

    trial: Trial
    rivals: tuple[Trial, ...]
    ranking: tuple[Trial, ...]
    total: float
    tried: int
    misfit_share: float | None


class AcceptedCause(NamedTuple):
    """A named effect with its step, and the values of all its parameters."""

    named: SelectedEffect
    step: Step
    values: FloatArray

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """Name and joints of the candidate that was accepted."""
        return self.step.trial.candidate.key[:2]


@dataclass(frozen=True)
class Survey:
    """
    What a look at all candidates showed.

    Attributes
    ----------
    ranking : tuple of Trial
        All visible candidates in their best shape, best first.
    material : mapping of Key to ndarray, shape (p,)
        Sizes of values of these from which on they are material, and have changed.
    hidden : frozenset of str
        Names of effects of which no candidate is visible beyond the nuisance columns.
    total : float
        Held-out squares that shares are of.
    tried : int
        Candidates that were tried, every shape for itself.
    unseen : tuple of (str, tuple of str)
        Names and joints of the candidates that are not visible.
    there : tuple of Trial
        Candidates that are significant, best first.
    nuisance : tuple of Trial
        Friction and offsets without given values, which are fitted jointly with all candidates.
    suspected : Trial or None
        The best candidate that might be named if more recordings told that it has changed.
    unproven : Trial or None
        The best candidate of all, if it might be named and the baseline shows nothing of it.

    """

    ranking: tuple[Trial, ...]
    material: Mapping[Key, FloatArray]
    hidden: frozenset[str]
    total: float
    tried: int
    unseen: tuple[tuple[str, tuple[str, ...]], ...]
    there: tuple[Trial, ...] = ()
    nuisance: tuple[Trial, ...] = ()
    suspected: Trial | None = None
    unproven: Trial | None = None

    def and_nuisance(self, trials: Sequence[Trial], least_visible: float) -> Survey:
        """Return the survey with trials of nuisance parameters."""
        seen = tuple(trial for trial in trials if trial.visible >= least_visible)
        effects = [trial.candidate.effect for trial in seen]
        keys = {trial.candidate.key[:2] for trial in seen}
        return replace(
            self,
            hidden=self.hidden - {effect.said_as for effect in effects},
            unseen=tuple(key for key in self.unseen if key not in keys),
            nuisance=seen,
        )

    @property
    def by_chance(self) -> float:
        """Mean gain per value over all visible candidates."""
        each = [max(trial.gain, 0.0) / max(trial.freedom, 1.0) for trial in self.ranking]
        return float(np.mean(each)) if each else 0.0
