# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Linear least squares with joint weights, outliers and coloured residuals.

The standard deviations come from the spectrum of the actual residuals: with filtered, over-sampled
or badly modelled torque neighbouring residuals are alike, and counting samples would promise far
too much.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args, Literal

from armid_ros.identification.fitting.triangle import (
    fit_scaled,
    fit_triangle,
    joint_std,
    positive,
    ROUNDS,
    Triangle,
    TriangleFit,
    within,
)
from armid_ros.identification.rows.regression import Regression
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import fft
import scipy.linalg

Method = Literal['ols', 'wls', 'irls']
Estimator = Literal['ols', 'wls', 'irls', 'iv']

#: All estimators.
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)
#: Description of each estimator.
IN_WORDS: dict[Estimator, str] = {
    'ols': 'ordinary least squares',
    'wls': 'least squares weighted by the noise of each joint',
    'irls': 'least squares weighted by the noise of each joint, outliers weighted down',
    'iv': 'instrumental variables from a simulation of the arm',
}

#: Residuals beyond this many robust standard deviations lose weight (Huber 1981: 95 % efficiency).
_HUBER = 1.345
#: Order of the autoregression that whitens residuals: the slopes of drift, and one resonance.
AR_ORDER = 3
#: Least share of the noise that a residual is taken to have kept in a band.
LEAST_LEFT = 0.1


@dataclass(frozen=True)
class Solution:
    """
    A least-squares fit.

    Attributes
    ----------
    values : ndarray, shape (r,)
        Parameters.
    covariance : ndarray, shape (r, r)
        Their covariance, correlation of the residuals included.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of every joint [N m].
    condition_number : float
        Of the weighted regressor.
    outliers : int
        Samples whose weight was reduced below one half.
    weights : ndarray, shape (N, n)
        What every row was multiplied by, all stretches one after the other.

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
    triangle: Triangle | None = None,
) -> Solution:
    """
    Fit parameters to one or more stretches of motion.

    Parameters
    ----------
    problem : sequence of Regression
        Stretches with the same columns.
    method : {'ols', 'wls', 'irls'}
        All joints alike; every joint by its own residual; that, with outliers weighted down
        (Huber's function).
    bounds : tuple of two ndarray, each of shape (r,), optional
        What is physically possible, lower and upper. The covariance is that without bounds.
    triangle : Triangle, optional
        That of the problem, where it is known.

    Returns
    -------
    Solution
        Parameters with covariance.

    """
    triangle = Triangle.of(problem) if triangle is None else triangle
    used = np.concatenate([part.informative for part in problem])
    fit = fit_triangle(triangle, weighted=method == 'wls')
    relative: FloatArray = used.astype(float)
    if method == 'irls':
        fit, relative = _robust(problem, used, fit)
    values = fit.values if bounds is None else within(fit.values, fit.factor, bounds)
    residual = _residual(problem, values)
    weights = np.asarray(relative / fit.scale)
    products = noise_products(problem, residual * weights, weights, fit.inverse)
    return Solution(
        values=values,
        covariance=fit.covariance(products),
        joint_std=joint_std(triangle, values),
        condition_number=fit.condition_number,
        outliers=int(np.sum(used & (relative**2 < 0.5))),
        weights=weights,
    )


def _robust(
    problem: Sequence[Regression], used: npt.NDArray[np.bool_], fit: TriangleFit
) -> tuple[TriangleFit, FloatArray]:
    """Weight outliers down; return the fit, and what its rows were multiplied by, (N, n)."""
    relative: FloatArray = used.astype(float)
    for _ in range(ROUNDS):
        before = (fit.scale, relative)
        residual = _residual(problem, fit.values)
        # the standard deviation that the middle half of each joint's residual suggests
        masked = np.where(used, residual, np.nan)
        spread = np.nanmedian(np.abs(masked - np.nanmedian(masked, axis=0)), axis=0)
        scale = positive(1.4826 * np.nan_to_num(spread))
        size = np.maximum(np.abs(residual) / scale, 1e-12)
        relative = np.asarray(used * np.sqrt(np.minimum(1.0, _HUBER / size)))
        fit = fit_scaled(Triangle.of(problem, relative), scale)
        if np.allclose(scale, before[0], rtol=1e-6) and np.allclose(relative, before[1]):
            break
    return fit, relative


def _residual(problem: Sequence[Regression], values: FloatArray) -> FloatArray:
    parts: list[FloatArray] = [part.target - part.columns @ values for part in problem]
    return np.concatenate(parts)


def noise_products(
    problem: Sequence[Regression],
    residual: FloatArray,
    weights: FloatArray,
    inverse: FloatArray,
    instruments: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """
    Return the covariance of the products of columns and noise, W' n.

    The noise of each joint is coloured, with a spectrum Phi that its residual tells; noises of
    different joints are taken as independent, those of different stretches too. A fit takes most
    of the noise where the regressor has its power, so the residual has less of it there: at a
    frequency of a joint the share x^H H^-1 x of what was, x being the transform of the joint's
    rows, its leverage.

    Parameters
    ----------
    problem : sequence of Regression
        Stretches, N samples in all, of r columns.
    residual, weights : ndarray, shape (N, n)
        Weighted residual of the fit, and the weights.
    inverse : ndarray, shape (r, r)
        Inverse of the triangular factor of the weighted problem: H^-1 = inverse inverse'.
    instruments : sequence of ndarray, each of shape (M, n, k), optional
        Further columns, one array a stretch.

    Returns
    -------
    ndarray, shape (r + k, r + k)

    """
    rank = len(inverse)
    extra = [np.empty((*part.tau.shape, 0)) for part in problem]
    added = extra if instruments is None else instruments
    size = rank + added[0].shape[2]
    products = np.zeros((size, size))
    start = 0
    for part, more in zip(problem, added, strict=True):
        count = len(part.tau)
        stop = start + count
        for joint in range(part.tau.shape[1]):
            columns = np.concatenate([part.columns[:, joint], more[:, joint]], axis=1)
            active = np.flatnonzero(columns.any(axis=0))
            weighted = columns.T[active] * weights[start:stop, joint]
            # one row a column: real and imaginary parts side by side make real products of it
            transformed = fft.rfft(weighted, 2 * count).view(float)
            fitted = active < rank
            taken = inverse[active[fitted]].T @ transformed[fitted]
            told = weights[start:stop, joint] > 0.0
            shares = np.einsum('ab,ab->b', taken, taken).reshape(-1, 2).sum(axis=1)
            leverage = shares / max(np.count_nonzero(told), 1)
            spectrum = _noise_spectrum(residual[start:stop, joint], told, leverage)
            spectrum[1:-1] *= 2.0  # the constant and the Nyquist bin have no mirror image
            transformed *= np.repeat(np.sqrt(spectrum / (2 * count)), 2)
            products[np.ix_(active, active)] += transformed @ transformed.T
        start = stop
    return products


def _noise_spectrum(
    residual: FloatArray, told: npt.NDArray[np.bool_], leverage: FloatArray
) -> FloatArray:
    """Estimate the power of noise (M + 1,) on the bins of an rfft from a residual (M,)."""
    count = len(residual)
    size = 2 * count
    # the autocovariance of the samples that tell something, over as many pairs as there are
    # (Parzen 1963), without the negative power that it may have where there are gaps
    sums, pairs = (
        np.fft.irfft(np.abs(np.fft.rfft(signal, size)) ** 2)[:count]
        for signal in (residual, told.astype(float))
    )
    lags = sums / np.maximum(pairs, 1.0) * np.arange(count, 0, -1) / count
    power = np.fft.rfft(np.concatenate([lags, [0.0], lags[:0:-1]])).real.clip(0.0)
    lags = np.fft.irfft(power, size)[:count]
    # whitened by an autoregression, smoothed by a Parzen window over lags, and coloured again,
    # which keeps peaks from being smoothed away (Andrews and Monahan 1992)
    order, whitening = min(AR_ORDER, len(lags) - 1), np.ones(count + 1)
    if lags[0] > 0.0 and order >= 1:
        regular = lags[: order + 1].copy()
        regular[0] *= 1.0 + 1e-6
        coefficients = scipy.linalg.solve_toeplitz(regular[:order], regular[1:])
        filtered = np.fft.rfft(np.concatenate([[1.0], -coefficients]), size)
        whitening = np.abs(filtered) ** 2
    lags = np.fft.irfft(power * whitening, size)[: count // 2]
    # how many lags matter: four times the first at which the correlation is noise
    quiet = np.abs(lags) < 2.0 / np.sqrt(count) * max(lags[0], 1e-300)
    first = int(np.argmax(quiet)) if np.any(quiet) else len(lags)
    reach = int(np.clip(4 * first, min(10, len(lags)), len(lags)))
    # what the fit took is made up for in the same band
    left = _smoothed(1.0 - leverage, reach).clip(LEAST_LEFT)
    return np.asarray(_smoothed(power * whitening, reach).clip(0.0) / left / whitening)


def _smoothed(spectrum: FloatArray, reach: int) -> FloatArray:
    """Smooth a spectrum on the bins of an rfft: keep lags below a reach, Parzen-weighted."""
    size = 2 * (len(spectrum) - 1)
    lags = np.fft.irfft(spectrum, size)
    x = np.arange(reach) / reach
    parzen = np.where(x < 0.5, 1 - 6 * x**2 + 6 * x**3, 2 * (1 - x) ** 3)
    tapered = np.zeros(size)
    tapered[:reach] = lags[:reach] * parzen
    tapered[size - reach + 1 :] = tapered[1:reach][::-1]
    return np.asarray(np.fft.rfft(tapered).real)
