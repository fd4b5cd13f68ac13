# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Spectrum of signals that are recorded in several stretches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from armid_ros.motion import FloatArray
import numpy as np
from scipy import signal


def mean_spectrum(
    stretches: Sequence[FloatArray],
    rate: float,
    detrend: Literal['constant', 'linear'] = 'constant',
    segment: float = 8.0,
) -> tuple[FloatArray, FloatArray]:
    """
    Return the mean power spectrum of stretches that last as long as a segment (Welch 1967).

    Parameters
    ----------
    stretches : sequence of ndarray, each (N, n)
        Evenly sampled signals; segments are no longer than the longest stretch.
    rate : float
        Samples per second.
    detrend : {'constant', 'linear'}
        Trend that is subtracted from every segment: its mean, or a line.
    segment : float
        Length of the segments [s].

    Returns
    -------
    frequency : ndarray, shape (K,)
        Frequencies [Hz].
    power : ndarray, shape (K, n)
        Power per Hz.

    """
    length = min(max(map(len, stretches)), int(segment * rate))
    long_enough = [values for values in stretches if len(values) >= length]
    spectra = [
        signal.welch(
            values, fs=rate, window='blackmanharris', nperseg=length, detrend=detrend, axis=0
        )
        for values in long_enough
    ]
    weights = [len(values) for values in long_enough]
    power = np.average([power for _, power in spectra], axis=0, weights=weights)
    return spectra[0][0], power
