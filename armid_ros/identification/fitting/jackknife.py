# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What values vary by when parts of the data are left out."""

from __future__ import annotations

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
