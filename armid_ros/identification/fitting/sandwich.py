# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Covariances of estimates whose errors are not those of white noise: bread, middle, bread.

The bread is the inverse of the information as far as white noise goes, the middle the covariance
of the scores. A spectrum of residuals tells it (`noise_products`), or the scores themselves.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.motion import FloatArray
import numpy as np


def sandwich(bread: FloatArray, middle: FloatArray) -> FloatArray:
    """Return bread middle bread', semi-definite whatever rounding does, shape (p, p)."""
    covariance = bread @ middle @ bread.T
    std = np.sqrt(np.maximum(np.abs(np.diag(covariance)), 1e-300))
    sizes, axes = np.linalg.eigh(covariance / np.outer(std, std))
    root = axes * np.sqrt(sizes.clip(0.0))
    root *= (std / np.maximum(np.linalg.norm(root, axis=1), 1e-300))[:, np.newaxis]
    return np.asarray(root @ root.T)


def score_products(scores: Sequence[FloatArray], lags: int) -> FloatArray:
    """
    Return the covariance of the sum of scores of which neighbours are alike.

    Source: Newey and West 1987.

    Parameters
    ----------
    scores : sequence of ndarray, each of shape (M, p)
        Of the rows of each stretch.
    lags : int
        Rows over which errors may last.

    Returns
    -------
    ndarray, shape (p, p)

    """
    products = np.zeros((scores[0].shape[1],) * 2)
    for part in scores:
        products += part.T @ part
        for lag in range(1, min(lags, len(part))):
            alike = (1.0 - lag / lags) * part[:-lag].T @ part[lag:]
            products += alike + alike.T
    return products


def widened(covariance: FloatArray, bread: FloatArray, middle: FloatArray) -> FloatArray:
    """Return a covariance, (p, p), with deviations no less than those of another middle."""
    ratio = np.diag(bread @ middle @ bread) / np.diag(covariance)
    factor = np.sqrt(np.maximum(ratio, 1.0))
    return np.asarray(covariance * np.outer(factor, factor))
