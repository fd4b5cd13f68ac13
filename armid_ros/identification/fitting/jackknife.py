# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What values vary by when parts of the data are left out.

Noise makes values as uncertain as their covariance. What a model gets wrong differs from motion
to motion, and other motions give other values: recordings that are left out show by how much.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.identification.rows.regression import Regression, weighted_rows
from armid_ros.motion import FloatArray
import numpy as np


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
