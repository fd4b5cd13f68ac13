# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Normal equations of which data do not tell every direction, and what they vary by without a part.

Noise makes values as uncertain as their covariance. What a model gets wrong differs from motion
to motion, and other motions give other values: recordings that are left out show by how much.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.identification.rows.regression import Regression, weighted_rows
from armid_ros.motion import FloatArray
import numpy as np
import scipy.linalg

#: Directions of columns scaled to one length with less than this share of the largest eigenvalue
#: are not identifiable: products of columns hold no more digits.
UNINFORMATIVE = 1e-10


@dataclass(frozen=True)
class NormalEquations:
    """
    What is known of values: a normal distribution in information form.

    Attributes
    ----------
    matrix : ndarray, shape (f, f)
        Inverse of the covariance; singular where some values are free.
    vector : ndarray, shape (f,)
        Matrix times mean.

    """

    matrix: FloatArray
    vector: FloatArray

    @classmethod
    def none(cls, size: int) -> NormalEquations:
        """Return that nothing is known of so many values."""
        return cls(np.zeros((size, size)), np.zeros(size))

    @classmethod
    def of_rows(cls, x: FloatArray, y: FloatArray) -> NormalEquations:
        """Return what rows over their noise tell, x (S, f) and y (S,)."""
        return cls(x.T @ x, x.T @ y)

    def among(self, kept: Sequence[int]) -> NormalEquations:
        """Return what is known of some of the values, the others being zero."""
        index = list(kept)
        return NormalEquations(self.matrix[np.ix_(index, index)], self.vector[index])

    def and_zeros(self, more: FloatArray) -> NormalEquations:
        """Return the same with more values behind, known to be zero with a precision (p,)."""
        size, whole = len(self.vector), len(self.vector) + len(more)
        matrix, vector = np.diag(np.concatenate([np.zeros(size), more])), np.zeros(whole)
        matrix[:size, :size], vector[:size] = self.matrix, self.vector
        return NormalEquations(matrix, vector)

    def solution(self) -> tuple[FloatArray, FloatArray]:
        """Return means and standard deviations, each (f,); zero where nothing is told."""
        basis = informative_basis(self.matrix)
        return basis @ (basis.T @ self.vector), np.sqrt(np.sum(basis**2, axis=1))

    def after(self, change: FloatArray) -> NormalEquations:
        """Return what is known of what is still to be added to values (f,)."""
        return replace(self, vector=self.vector - self.matrix @ change)

    def __add__(self, other: NormalEquations) -> NormalEquations:
        """Return what two independent sources tell together."""
        return NormalEquations(self.matrix + other.matrix, self.vector + other.vector)

    def __sub__(self, other: NormalEquations) -> NormalEquations:
        """Return what is known without one of the sources."""
        return NormalEquations(self.matrix - other.matrix, self.vector - other.vector)


def informative_basis(products: FloatArray) -> FloatArray:
    """
    Return the identifiable directions.

    Parameters
    ----------
    products : ndarray, shape (p, p)
        Products of columns with each other; positive semi-definite.

    Returns
    -------
    ndarray, shape (p, k)
        B of the pseudo-inverse B B'.

    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(products), 1e-300))
    scaled = products * np.outer(scale, scale)
    lower, failed = scipy.linalg.lapack.dpotrf(scaled, lower=True)
    if not failed and len(scaled):
        inverse, _ = scipy.linalg.lapack.dtrtri(lower, lower=True)
        # the smallest eigenvalue is at least one over the trace of the inverse, and the largest
        # at most the trace of the products: every direction is told
        if np.sum(inverse**2) * np.trace(scaled) * UNINFORMATIVE <= 1.0:
            return np.asarray(scale[:, np.newaxis] * inverse.T)
    values, vectors = np.linalg.eigh(scaled)
    good = values > UNINFORMATIVE * max(float(values.max(initial=0.0)), 1e-300)
    return np.asarray(scale[:, np.newaxis] * vectors[:, good] / np.sqrt(values[good]))


def scaled_inverse(matrix: FloatArray) -> FloatArray:
    """
    Invert a covariance or a precision, (p, p), whose values may be of any units.

    Directions of less than a rounding error of the others get that.

    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    both = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(matrix * both + UNINFORMATIVE * np.eye(len(matrix))) * both)


def informative_solution(products: FloatArray, aim: FloatArray) -> FloatArray:
    """
    Solve normal equations; directions that are not identifiable get no change.

    Parameters
    ----------
    products : ndarray, shape (p, p)
        Products of columns with each other; positive semi-definite.
    aim : ndarray, shape (p,) or (p, k)
        Products of the columns with what they are to make.

    Returns
    -------
    ndarray, shape (p,) or (p, k)

    """
    basis = informative_basis(products)
    return np.asarray(basis @ (basis.T @ aim))


def jackknife(
    values: FloatArray, std: FloatArray, held_values: FloatArray, held_std: FloatArray
) -> FloatArray:
    """
    Return the variance of least-squares values whatever the colour of the noise, shape (p,).

    What a value changes by without a part counts by what the other parts tell of it: where noise
    is white the mean of this is its variance, also where one part tells most of a value, as where
    a joint moves in that part alone. A value that the others do not tell counts nothing.

    Parameters
    ----------
    values, std : ndarray, shape (p,)
        Fitted to all parts, and deviations as far as white noise goes.
    held_values, held_std : ndarray, shape (K, p)
        The same without each part; deviations are zero where nothing tells a value.

    References
    ----------
    Wu, Jackknife, bootstrap and other resampling methods in regression analysis, Annals of
    Statistics 14, 1986.

    """
    return np.asarray(np.sum(changes(values, std, held_values, held_std) ** 2, axis=0))


def changes(
    values: FloatArray, std: FloatArray, held_values: FloatArray, held_std: FloatArray
) -> FloatArray:
    """Return what values change by without each part, (K, p), whose squares `jackknife` sums."""
    seen = held_std > 0.0
    told = np.where(seen, std / np.where(seen, held_std, 1.0), 0.0)
    return np.asarray(told * (held_values - values))


def scatter(problem: Sequence[Regression], weights: FloatArray, values: FloatArray) -> FloatArray:
    """
    Return the changes of values without each recording, of which squares sum up to a variance.

    A change counts by what the others tell of the value; see `jackknife`.

    Parameters
    ----------
    problem : sequence of Regression
        N rows of r columns.
    weights : ndarray, shape (N, n)
        What the fit multiplied the rows of every joint by.
    values : ndarray, shape (r,)
        What was fitted.

    Returns
    -------
    ndarray, shape (K, r)
        For each of K recordings; empty for a single one, zero where one alone tells a value.

    """
    parts: dict[str, NormalEquations] = {}
    first = 0
    for part in problem:
        weight = weights[first : first + len(part.target)]
        first += len(part.target)
        columns, target = weighted_rows([part], weight)
        own = NormalEquations.of_rows(columns, target - columns @ values)
        parts[part.source] = parts[part.source] + own if part.source in parts else own
    if len(parts) < 2:
        return np.zeros((0, len(values)))
    whole = sum(parts.values(), start=NormalEquations.none(len(values)))
    held = [(whole - recording).solution() for recording in parts.values()]
    return changes(*whole.solution(), *np.array(held).transpose(1, 0, 2))
