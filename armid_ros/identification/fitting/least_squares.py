# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Linear least squares with joint weights, outliers and coloured residuals.

The standard deviations come from the spectrum of the actual residuals. With filtered,
over-sampled or badly modelled torque, neighbouring residuals are correlated. Standard deviations
for independent samples would be far too small.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args, Literal

from armid_ros.identification.fitting.covariance import noise_products, sandwich
from armid_ros.identification.fitting.normal_equations import (
    NormalEquations,
    positive,
    ROUNDS,
    scaled_fit,
    weighted_fit,
    WeightedFit,
    within,
)
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt

Method = Literal['ols', 'wls', 'irls']
Estimator = Literal['ols', 'wls', 'irls', 'iv']

#: All estimators.
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)
#: Description of each estimator.
IN_WORDS: dict[Estimator, str] = {
    'ols': 'ordinary least squares',
    'wls': 'least squares weighted by the noise of each joint',
    'irls': 'least squares weighted by the noise of each joint, outliers weighted down',
    'iv': 'instrumental variables from the smoothed motion',
}


@dataclass(frozen=True)
class Solution:
    """
    A least-squares fit.

    Attributes
    ----------
    values : ndarray, shape (r,)
        Parameters.
    covariance : ndarray, shape (r, r)
        Covariance of the parameters, correlation of the residuals included.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of every joint [N m].
    condition_number : float
        Condition number of the weighted regressor.
    outliers : int
        Samples whose weight was reduced below one half.
    weights : ndarray, shape (N, n)
        Factors of the rows of all stretches, one after the other.

    """

    values: FloatArray
    covariance: FloatArray
    joint_std: FloatArray
    condition_number: float
    outliers: int
    weights: FloatArray


def solve(
    problem: Sequence[Regression],
    method: Method = 'wls',
    bounds: tuple[FloatArray, FloatArray] | None = None,
) -> Solution:
    """
    Fit parameters to one or more stretches of motion.

    Parameters
    ----------
    problem : sequence of Regression
        Stretches with the same columns.
    method : {'ols', 'wls', 'irls'}
        Equal weights; weights by the residual of each joint; the latter with outliers weighted
        down (Huber's function).
    bounds : tuple of two ndarray, each of shape (r,), optional
        Lower and upper bounds of physical values. The covariance is that without bounds.

    Returns
    -------
    Solution
        Parameters with covariance.

    """
    normal = NormalEquations.of(problem)
    used = np.concatenate([part.informative for part in problem])
    fit = weighted_fit(normal, weighted=method == 'wls')
    relative: FloatArray = used.astype(float)
    if method == 'irls':
        fit, relative = _robust(problem, used, fit)
    values = fit.values if bounds is None else within(fit.values, fit.factor, bounds)
    weights = np.asarray(relative / fit.scale)
    residual = np.concatenate([part.residual(values) for part in problem])
    products = noise_products(problem, residual * weights, weights, fit.inverse)
    return Solution(
        values=values,
        covariance=sandwich(fit.bread, products),
        joint_std=normal.joint_std(values),
        condition_number=fit.condition_number,
        outliers=int(np.sum(used & (relative**2 < 0.5))),
        weights=weights,
    )


def _robust(
    problem: Sequence[Regression], used: npt.NDArray[np.bool_], fit: WeightedFit
) -> tuple[WeightedFit, FloatArray]:
    """Reduce the weight of outliers; return the fit and the unscaled row factors, (N, n)."""
    relative: FloatArray = used.astype(float)
    for _ in range(ROUNDS):
        before = (fit.scale, relative)
        residual = np.concatenate([part.residual(fit.values) for part in problem])
        # standard deviation of each joint's residual, from its median absolute deviation
        masked = np.where(used, residual, np.nan)
        spread = np.nanmedian(np.abs(masked - np.nanmedian(masked, axis=0)), axis=0)
        scale = positive(1.4826 * np.nan_to_num(spread))
        size = np.maximum(np.abs(residual) / scale, 1e-12)
        # residuals beyond this many robust standard deviations lose weight (Huber 1981: 95 %
        # efficiency)
        relative = np.asarray(used * np.sqrt(np.minimum(1.0, 1.345 / size)))
        fit = scaled_fit(NormalEquations.of(problem, relative), scale)
        if np.allclose(scale, before[0], rtol=1e-6) and np.allclose(relative, before[1]):
            break
    return fit, relative
