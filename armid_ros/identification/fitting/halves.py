# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How well one half of the data predicts the other: what a fit to its own data does not show.

Where motion is too short or too poor, parameters are what the noise makes them; either half then
gives others, and predicts the other half badly.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.identification.fitting.normal_equations import informative_solution
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import FloatArray
import numpy as np

#: Rows that are enough of any data: some fifty for every parameter of seven joints.
_ROWS = 4000


@dataclass(frozen=True)
class HalvesError:
    """
    Relative torque error when either half of the data predicts the other.

    Attributes
    ----------
    whole : float
        Of all joints together [%].
    joints : ndarray, shape (n,)
        Of each joint, as a share of its own torque [%].

    """

    whole: float
    joints: FloatArray


def halves_error(
    problem: Sequence[Regression],
    weights: FloatArray,
    described: FloatArray,
    spread: FloatArray | None = None,
) -> HalvesError:
    """
    Fit the first half and predict the second, and the other way round.

    Parameters
    ----------
    problem : sequence of Regression
        N rows of r columns, in the order of time.
    weights : ndarray, shape (N, n)
        What the fit multiplied the rows of every joint by: the inverse of their residual.
    described : ndarray, shape (r,)
        Values of the description, where those stay that a half does not tell.
    spread : ndarray, shape (r,), optional
        What they may be off by; as much as the torque there is if nothing is said.

    Returns
    -------
    HalvesError
        Of the predicted torque.

    """
    step = max(1, sum(len(part.tau) for part in problem) // _ROWS)
    columns = np.concatenate([part.columns for part in problem])[::step]
    tau = np.concatenate([part.tau for part in problem])[::step]
    target = np.concatenate([part.target for part in problem])[::step]
    told = np.concatenate([part.informative for part in problem])[::step]
    rest, weight = target - columns @ described, weights[::step]
    most = np.full(len(described), np.inf) if spread is None else spread
    middle = len(tau) // 2
    halves = slice(0, middle), slice(middle, None)
    left = np.zeros_like(tau)
    for fitted, predicted in (halves, halves[::-1]):
        # a Bayesian estimate in units of the residual, of changes as large as the description may
        # be off by, or as the torque there is; without it, what a half does not tell at all would
        # be any number. Where next to nothing is left, the residual is no unit, and what a half
        # does not tell stays as it is described
        own = weight[fitted]
        stacked = (columns[fitted] * own[:, :, np.newaxis]).reshape(-1, columns.shape[2])
        size = np.sqrt(np.mean(stacked**2, axis=0))
        size = np.where(size > 0.0, size, 1.0)
        torque = np.sqrt(np.mean((tau[fitted] * own) ** 2))
        stacked = stacked / size
        normal = stacked.T @ stacked
        normal[np.diag_indices_from(normal)] += 1.0 / max(torque, 1.0) ** 2 + (most * size) ** -2.0
        aim = stacked.T @ (rest[fitted] * own).ravel()
        change = informative_solution(normal, aim) / size
        left[predicted] = rest[predicted] - columns[predicted] @ change
    error, length = (np.linalg.norm(told * rows, axis=0) for rows in (left, tau))
    whole = float(np.linalg.norm(length))
    return HalvesError(
        float(100.0 * np.linalg.norm(error) / whole) if whole > 0.0 else 0.0,
        100.0 * np.divide(error, length, out=np.zeros_like(error), where=length > 0.0),
    )
