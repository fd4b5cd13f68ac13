# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Normal equations that are singular, and how much values vary without each recording.

Noise makes values as uncertain as their covariance. What a model gets wrong differs from motion
to motion, and other motions give other values: recordings that are left out show by how much.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.rows.regression import Regression, weighted_rows
from armid_ros.motion import FloatArray
import numpy as np
import scipy.linalg

#: Directions of columns scaled to one length with less than this share of the largest eigenvalue
#: are not identifiable: products of columns hold no more digits.
UNINFORMATIVE = 1e-10


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
        # at most the trace of the products: every direction is determined
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


def scatter(problem: Sequence[Regression], weights: FloatArray, values: FloatArray) -> FloatArray:
    """
    Return the changes of values without each recording, of which squares sum up to a variance.

    A change counts by what the other recordings determine of the value: for white noise the
    squares then sum up to the variance of least squares, also where one recording determines most
    of a value. A value that the others do not determine has no change.

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
        For each of K recordings; empty for a single one.

    References
    ----------
    Wu, Jackknife, bootstrap and other resampling methods in regression analysis, Annals of
    Statistics 14, 1986.

    """
    parts: dict[str, FloatArray] = {}
    first = 0
    for part in problem:
        weight = weights[first : first + len(part.target)]
        first += len(part.target)
        columns, target = weighted_rows([part], weight)
        own = columns.T @ np.column_stack([columns, target - columns @ values])
        parts[part.source] = parts.get(part.source, np.zeros_like(own)) + own
    if len(parts) < 2:
        return np.zeros((0, len(values)))
    products = np.array(list(parts.values()))
    whole = products.sum(axis=0)
    change, std = _solution(whole)
    result = []
    for own in products:
        held_change, held_std = _solution(whole - own)
        seen = held_std > 0.0
        share = np.where(seen, std / np.where(seen, held_std, 1.0), 0.0)
        result.append(share * (held_change - change))
    return np.array(result)


def _solution(products: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return means and deviations, (p,), of normal equations (p, p + 1), zero if not seen."""
    basis = informative_basis(products[:, :-1])
    return basis @ (basis.T @ products[:, -1]), np.sqrt(np.sum(basis**2, axis=1))
