# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What values vary by from one recording to another.

Noise makes values as uncertain as their covariance. What a model gets wrong differs from motion
to motion, and other motions give other values: recordings that are left out show by how much.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.fitting.jackknife import changes
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import FloatArray
import numpy as np


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
        columns = (part.columns * weight[:, :, np.newaxis]).reshape(-1, len(values))
        rest = (part.target - part.columns @ values) * weight
        own = NormalEquations.of_rows(columns, rest.ravel())
        parts[part.source] = parts[part.source] + own if part.source in parts else own
    if len(parts) < 2:
        return np.zeros((0, len(values)))
    whole = sum(parts.values(), start=NormalEquations.none(len(values)))
    held = [(whole - recording).solution() for recording in parts.values()]
    return changes(*whole.solution(), *np.array(held).transpose(1, 0, 2))
