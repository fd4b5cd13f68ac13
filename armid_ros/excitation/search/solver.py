# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The solver of a search: SLSQP of SciPy on scaled coefficients."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from armid_ros.excitation.limits import Limits
from armid_ros.excitation.random_trajectory import position_range
from armid_ros.excitation.search.constraints import Constraints
from armid_ros.excitation.search.objective import Objective
from armid_ros.motion import FloatArray
import numpy as np
import scipy.optimize

#: Stands in for an infinite cost, which a line search cannot work with.
_NO_COST = 1e3

_Result = TypeVar('_Result')


def solve(
    objective: Objective,
    constraints: Constraints,
    scale: FloatArray,
    x: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    iterations: int,
    step: Callable[[int], None],
) -> tuple[FloatArray, int]:
    """
    Run SLSQP.

    Parameters
    ----------
    objective, constraints : Objective, Constraints
        What to make small, and what to keep.
    scale, x : ndarray, shape (n, 1 + 2 H)
        Unit of every coefficient, and where to begin in these units.
    bounds : tuple of ndarray
        Least and largest values, in these units.
    iterations : int
        How many at most.
    step : callable
        Told the number of iterations after each.

    Returns
    -------
    z : ndarray, shape (n, 1 + 2 H)
        Where it ended, in these units.
    count : int
        Iterations it took, one at least.

    """
    count = 0
    cost = _Last(lambda z: objective.value(z.reshape(scale.shape) * scale))
    limits = _Last(lambda z: constraints.value(z.reshape(scale.shape) * scale))

    def counted(z: FloatArray) -> None:
        nonlocal count
        count += 1
        step(count)

    result = scipy.optimize.minimize(
        lambda z: cost(z)[0] if np.isfinite(cost(z)[0]) else _NO_COST,
        x.ravel(),
        jac=lambda z: (cost(z)[1]() * scale).ravel(),
        method='SLSQP',
        bounds=scipy.optimize.Bounds(bounds[0].ravel(), bounds[1].ravel()),
        constraints=[
            {
                'type': 'ineq',
                'fun': lambda z: -limits(z)[0],
                'jac': lambda z: -(limits(z)[1]() * scale).reshape(-1, scale.size),
            }
        ],
        options={'maxiter': iterations, 'ftol': 1e-5},
        callback=counted,
    )
    return np.asarray(result.x).reshape(scale.shape), max(count, 1)


def coefficient_scale(limits: Limits, period: float, harmonics: int) -> FloatArray:
    """Size of every coefficient that alone reaches a limit, shape (n, 1 + 2 H)."""
    lower, upper = position_range(limits)
    half = 0.5 * (upper - lower)[:, np.newaxis]
    k = 2.0 * np.pi / period * np.arange(1, harmonics + 1)
    largest = np.minimum(limits.velocity[:, np.newaxis], limits.acceleration[:, np.newaxis] / k)
    amplitude = np.minimum(half * k, largest) / np.sqrt(harmonics)
    return np.column_stack([half, amplitude, amplitude])


def coefficient_range(limits: Limits, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Bound the scaled coefficients by what no feasible trajectory can exceed.

    The amplitude of a harmonic is at most 4 / pi times the largest value of the curve.

    """
    harmonics = (scale.shape[1] - 1) // 2
    upper = np.full_like(scale, 4.0 / np.pi * np.sqrt(harmonics))
    lower = -upper
    low, high = position_range(limits)
    lower[:, 0], upper[:, 0] = low / scale[:, 0], high / scale[:, 0]
    return lower, upper


class _Last(Generic[_Result]):
    """A function that remembers the last point and what came out there."""

    def __init__(self, function: Callable[[FloatArray], _Result]) -> None:
        self._function = function
        self._known: tuple[bytes, _Result] | None = None

    def __call__(self, z: FloatArray) -> _Result:
        if self._known is None or self._known[0] != z.tobytes():
            self._known = z.tobytes(), self._function(z)
        return self._known[1]
