# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How unlikely a change is where values differ from recording to recording anyway.

The misfit of a model differs from motion to motion, and so do values that follow it: of hundreds
of candidates some resemble the difference of two days. An analysis of variance compares what a
change explains with what values of each recording explain beside those of its day.

Few recordings determine that spread badly. Other candidates say what is usual of the arm, on the
day when nothing was wrong: the variance is the mean of both, each counted by its degrees of
freedom (Smyth, Linear models and empirical Bayes methods for assessing differential expression in
microarray experiments, Statistical Applications in Genetics and Molecular Biology 3, 2004).
Recordings are what is independent: all values of a candidate follow the same misfit.

"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.search.trial import Key
from armid_ros.identification.fitting.normal_equations import (
    independent_inverse,
    informative_basis,
    NormalEquations,
)
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import special, stats
import scipy.linalg


@dataclass(frozen=True)
class Variance:
    """
    Analysis of variance of a candidate.

    Attributes
    ----------
    between : float
        Weighted squares that another value on each day explains, over their number.
    within : tuple of float
        Weighted squares that another value in each recording of a day explains beside these, over
        their number, of each day.
    values : float
        Number of values of the candidate.
    freedom : tuple of int
        Recordings of each day that show the candidate, less one.

    """

    between: float
    within: tuple[float, ...]
    values: float
    freedom: tuple[int, ...]


@dataclass(frozen=True)
class Recordings:
    """
    Weighted recordings of two days.

    Attributes
    ----------
    free : tuple of ndarray, each (S, f)
        Nuisance columns; those that are zero in a recording may be left out at the end.
    rest : tuple of ndarray, each (S,)
        Residual of nuisance parameters that are fitted to all recordings.
    today : ndarray of bool, shape (m,)
        Which of them are of the second day.
    basis : ndarray, shape (F, k)
        Root of the inverse of the normal matrix of the nuisance parameters.

    """

    free: tuple[FloatArray, ...]
    rest: tuple[FloatArray, ...]
    today: npt.NDArray[np.bool_]
    basis: FloatArray

    @classmethod
    def of(
        cls,
        free: Sequence[FloatArray],
        residual: Sequence[FloatArray],
        today: Sequence[bool],
        known: NormalEquations,
    ) -> Recordings:
        """Fit the nuisance parameters; ``known`` are the normal equations of all recordings."""
        basis = informative_basis(known.matrix)
        theta = basis @ (basis.T @ known.vector)
        pairs = zip(free, residual, strict=True)
        rest = tuple(y - x @ theta[: x.shape[1]] for x, y in pairs)
        return cls(tuple(free), rest, np.array(today), basis)

    @property
    def before(self) -> float:
        """Share of the entries that are of the first day."""
        count = np.array([np.count_nonzero(rest) for rest in self.rest])
        return float(count[~self.today].sum() / count.sum())

    def variance(
        self, own: Sequence[FloatArray], precision: FloatArray, values: float, faint: float
    ) -> Variance | None:
        """
        Return the analysis of variance of a candidate; None if a day hardly shows any of it.

        Parameters
        ----------
        own : sequence of ndarray, each (S, p)
            Columns of the candidate in each recording.
        precision : ndarray, shape (p,)
            Prior precision of its values, about zero.
        values : float
            Number of its values that the data determine.
        faint : float
            Share of the squares of every column up to which a recording hardly shows it. What
            such a recording says of the candidate is left out.

        """
        pairs = list(zip(self.free, own, strict=True))
        border = np.array([self.basis[: f.shape[1]].T @ (f.T @ x) for f, x in pairs])
        square = np.array([x.T @ x for x in own])
        aim = np.array([x.T @ rest for x, rest in zip(own, self.rest, strict=True)])
        whole = np.diag(square.sum(axis=0))
        shares = np.diagonal(square, axis1=1, axis2=2) / np.maximum(whole, 1e-300)
        shows = shares.max(axis=1) > faint
        days = [shows & ~self.today, shows & self.today]
        if values <= 0.0 or not all(day.any() for day in days):
            return None

        def explained(groups: Iterable[npt.NDArray[np.bool_]]) -> float:
            """Return the squares that values of each group explain."""
            sums = [[part[one].sum(axis=0) for part in (border, square, aim)] for one in groups]
            borders, squares, aims = zip(*sums, strict=True)
            both, wanted = np.concatenate(borders, axis=1), np.concatenate(aims)
            products = scipy.linalg.block_diag(*squares) - both.T @ both
            held = np.tile(precision, len(sums))  # a planar arm shows some values of a body only
            scale = np.tile(whole + precision, len(sums))
            return float(wanted @ independent_inverse(products + np.diag(held), scale) @ wanted)

        each = np.eye(len(own), dtype=bool)
        between = explained(days) - explained([shows])
        within = [explained(each[day]) - explained([day]) for day in days]
        return Variance(
            max(between, 0.0) / values,
            tuple(max(one, 0.0) / values for one in within),
            values,
            tuple(int(day.sum()) - 1 for day in days),
        )


@dataclass(frozen=True)
class UsualSpread:
    """
    What values of candidates usually differ by from recording to recording.

    Attributes
    ----------
    variance : float
        Over that for white noise.
    freedom : float
        Degrees of freedom that it counts for beside those of a candidate itself.

    """

    variance: float
    freedom: float

    @classmethod
    def of(cls, found: Iterable[Variance], freedom: float) -> UsualSpread | None:
        """
        Return what is usual of some candidates on the first day that has two recordings.

        None if no day has. What is wrong on a later day is in the values of most candidates.

        """
        for days in zip(
            *(zip(one.within, one.freedom, strict=True) for one in found), strict=True
        ):
            logarithms = [
                np.log(squares / own) - _log_chi_square(own)
                for squares, own in days
                if own and squares > 0.0
            ]
            if logarithms:
                usual = np.exp(np.mean(logarithms) + _log_chi_square(freedom))
                return cls(float(usual), freedom)
        return None

    def chance(self, found: Variance) -> float:
        """Return the probability of as large a change where nothing has changed."""
        freedom = self.freedom + sum(found.freedom)
        expected = (self.freedom * self.variance + sum(found.within)) / freedom
        return float(stats.f.sf(found.between / expected, found.values, freedom))

    def largest(self, chance: float, freedom: int) -> float:
        """Return the squares of a change of a value that are so unlikely, over the variance."""
        return float(stats.f.isf(chance, 1, self.freedom + freedom))


def _log_chi_square(freedom: float) -> float:
    """Return the mean logarithm of a chi-square variable over its degrees of freedom."""
    return float(special.digamma(0.5 * freedom) - np.log(0.5 * freedom))


@dataclass(frozen=True)
class Changed:
    """
    What a test of the changes of candidates says.

    Whether anything has changed is one question, and which of the candidates is another: where one
    surely has, those that are as unlikely by themselves may be it.

    Attributes
    ----------
    surely : frozenset of Key
        Candidates that have changed, whatever number of them was tested.
    singly : frozenset of Key
        Candidates that would have changed if no other had been tested.
    deviations : float
        Deviations for white noise by which a value has to differ from its baseline to have
        changed.

    """

    surely: frozenset[Key]
    singly: frozenset[Key]
    deviations: float

    @property
    def changed(self) -> frozenset[Key]:
        """Candidates that have changed."""
        return self.surely | self.singly if self.surely else frozenset()

    @property
    def suspected(self) -> frozenset[Key]:
        """Candidates that may have changed where none surely has."""
        return frozenset() if self.surely else self.singly

    def among(self, keys: Collection[Key], certain: Collection[Key]) -> Changed:
        """Return the same where only some candidates can say that anything has, some by size."""
        return replace(self, surely=self.surely.union(certain).intersection(keys))
