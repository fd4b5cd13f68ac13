# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Sandwich covariances, B M B', of estimates whose errors are not white noise.

The bread B is the inverse of the products of the columns. The middle M is the covariance of the
products of columns and noise. M follows from the spectrum of the residuals (`noise_products`) or
from neighbouring scores (`score_products`).

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.rows.regression import by_stretch, Regression
from armid_ros.motion import FloatArray
import numpy as np
import numpy.typing as npt
from scipy import fft
import scipy.linalg

#: Lower bound of the share of the noise that remains in the residual of a band.
MIN_RESIDUAL_SHARE = 0.1


def sandwich(bread: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the sandwich covariance B M B', with B = `bread` and M = `middle`."""
    covariance = bread @ middle @ bread.T
    std = np.sqrt(np.maximum(np.abs(np.diag(covariance)), 1e-300))
    sizes, axes = np.linalg.eigh(covariance / np.outer(std, std))
    root = axes * np.sqrt(sizes.clip(0.0))
    root *= (std / np.maximum(np.linalg.norm(root, axis=1), 1e-300))[:, np.newaxis]
    return np.asarray(root @ root.T)


def score_products(scores: Sequence[FloatArray], lags: int) -> FloatArray:
    """
    Return the covariance of a sum of scores, with correlated neighbouring samples, (p, p).

    Source: Newey and West 1987.

    Parameters
    ----------
    scores : sequence of ndarray, each of shape (M, p)
        Scores of the samples of each stretch: products of columns and residual.
    lags : int
        Number of samples over which errors may be correlated.

    Returns
    -------
    ndarray, shape (p, p)

    """
    products = np.zeros((scores[0].shape[1],) * 2)
    for part in scores:
        products += part.T @ part
        for lag in range(1, min(lags, len(part))):
            lagged = (1.0 - lag / lags) * part[:-lag].T @ part[lag:]
            products += lagged + lagged.T
    return products


def widened(covariance: FloatArray, bread: FloatArray, middle: FloatArray) -> FloatArray:
    """Raise each variance of a covariance to at least the variance of a sandwich B M B'."""
    ratio = np.diag(bread @ middle @ bread) / np.diag(covariance)
    factor = np.sqrt(np.maximum(ratio, 1.0))
    return np.asarray(covariance * np.outer(factor, factor))


def noise_products(
    problem: Sequence[Regression],
    residual: FloatArray,
    weights: FloatArray,
    inverse: FloatArray,
    instruments: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """
    Return the covariance of W' e, with weighted regressor W and coloured torque noise e.

    The noise of each joint is coloured, with a spectrum Phi that is estimated from its residual.
    Noise is taken as independent between joints and between stretches. A fit removes noise at
    frequencies at which the regressor has power. At each frequency, it removes the share
    x^H H^-1 x (leverage), where x is the Fourier transform of the joint's columns.

    Parameters
    ----------
    problem : sequence of Regression
        Stretches, N samples in all, of r columns.
    residual, weights : ndarray, shape (N, n)
        Weighted residual of the fit, and the weights.
    inverse : ndarray, shape (r, r)
        Inverse of the triangular factor of the weighted problem: H^-1 = inverse inverse'.
    instruments : sequence of ndarray, each of shape (M, n, k), optional
        Further columns, one array per stretch.

    Returns
    -------
    ndarray, shape (r + k, r + k)

    """
    rank = len(inverse)
    extra = [np.empty((*part.tau.shape, 0)) for part in problem]
    added = extra if instruments is None else instruments
    size = rank + added[0].shape[2]
    products = np.zeros((size, size))
    splits = (by_stretch(problem, rows) for rows in (residual, weights))
    for part, more, left, weight in zip(problem, added, *splits, strict=True):
        count = len(part.tau)
        for joint in range(part.tau.shape[1]):
            columns = np.concatenate([part.columns[:, joint], more[:, joint]], axis=1)
            active = np.flatnonzero(columns.any(axis=0))
            weighted = columns.T[active] * weight[:, joint]
            # one row per column; real and imaginary parts next to each other give real products
            transformed = fft.rfft(weighted, 2 * count).view(float)
            fitted = active < rank
            taken = inverse[active[fitted]].T @ transformed[fitted]
            informative = weight[:, joint] > 0.0
            shares = np.einsum('ab,ab->b', taken, taken).reshape(-1, 2).sum(axis=1)
            leverage = shares / max(np.count_nonzero(informative), 1)
            spectrum = _noise_spectrum(left[:, joint], informative, leverage)
            spectrum[1:-1] *= 2.0  # the constant and the Nyquist bin have no conjugate
            transformed *= np.repeat(np.sqrt(spectrum / (2 * count)), 2)
            products[np.ix_(active, active)] += transformed @ transformed.T
    return products


def _noise_spectrum(
    residual: FloatArray, informative: npt.NDArray[np.bool_], leverage: FloatArray
) -> FloatArray:
    """Return the power spectrum (M + 1,) of a joint's torque noise, from residuals (M,)."""
    count = len(residual)
    size = 2 * count
    # the autocovariance of the informative samples is divided by the number of their pairs
    # (Parzen 1963); negative power due to gaps is removed
    sums, pairs = (
        np.fft.irfft(np.abs(np.fft.rfft(signal, size)) ** 2)[:count]
        for signal in (residual, informative.astype(float))
    )
    lags = sums / np.maximum(pairs, 1.0) * np.arange(count, 0, -1) / count
    power = np.fft.rfft(np.concatenate([lags, [0.0], lags[:0:-1]])).real.clip(0.0)
    lags = np.fft.irfft(power, size)[:count]
    # whitened by an autoregression, smoothed by a Parzen window over lags, and coloured again,
    # which keeps peaks from being smoothed away (Andrews and Monahan 1992)
    # order of the autoregression that whitens residuals: enough for drift and one resonance
    order, whitening = min(3, len(lags) - 1), np.ones(count + 1)
    if lags[0] > 0.0 and order >= 1:
        regular = lags[: order + 1].copy()
        regular[0] *= 1.0 + 1e-6
        coefficients = scipy.linalg.solve_toeplitz(regular[:order], regular[1:])
        filtered = np.fft.rfft(np.concatenate([[1.0], -coefficients]), size)
        whitening = np.abs(filtered) ** 2
    lags = np.fft.irfft(power * whitening, size)[: count // 2]
    # number of lags: four times the first lag at which the correlation is only noise
    quiet = np.abs(lags) < 2.0 / np.sqrt(count) * max(lags[0], 1e-300)
    first = int(np.argmax(quiet)) if np.any(quiet) else len(lags)
    reach = int(np.clip(4 * first, min(10, len(lags)), len(lags)))
    # the noise that the fit removed from a band is added again
    left = _smoothed(1.0 - leverage, reach).clip(MIN_RESIDUAL_SHARE)
    return np.asarray(_smoothed(power * whitening, reach).clip(0.0) / left / whitening)


def _smoothed(spectrum: FloatArray, reach: int) -> FloatArray:
    """Return a power spectrum smoothed by Parzen's window over the first `reach` lags."""
    size = 2 * (len(spectrum) - 1)
    lags = np.fft.irfft(spectrum, size)
    x = np.arange(reach) / reach
    parzen = np.where(x < 0.5, 1 - 6 * x**2 + 6 * x**3, 2 * (1 - x) ** 3)
    tapered = np.zeros(size)
    tapered[:reach] = lags[:reach] * parzen
    tapered[size - reach + 1 :] = tapered[1:reach][::-1]
    return np.asarray(np.fft.rfft(tapered).real)
