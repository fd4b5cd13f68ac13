# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Frequency responses straight from the data, of no model and no order."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.motion import FloatArray
from armid_ros.papers.elastic.identification.subspace import Signals
import numpy as np
import numpy.typing as npt
from scipy.signal import get_window

ComplexArray = npt.NDArray[np.complex128]


def measured_response(
    experiments: Sequence[Signals],
    dt: float,
    *,
    window: float = 1.0,
) -> tuple[FloatArray, ComplexArray]:
    """
    Estimate the frequency response from all inputs to all outputs by averaged spectra (H1).

    The first input is held between samples; its response is that to the continuous, held signal.

    Parameters
    ----------
    experiments : sequence of Signals
        With m inputs and p outputs.
    dt : float
        Time between samples [s].
    window : float
        Length of the averaged stretches [s], half overlapping, under a Hann window; no longer than
        the experiments.

    Returns
    -------
    frequency : ndarray, shape (K,)
        [Hz], zero left out.
    response : ndarray of complex, shape (K, p, m)

    """
    size = round(window / dt)
    taper = get_window('hann', size)[:, np.newaxis]
    cross: list[ComplexArray] = []
    power: list[ComplexArray] = []
    for e in experiments:
        for start in range(0, len(e.u) - size + 1, size // 2):
            part = slice(start, start + size)
            u, y = (
                np.fft.rfft(taper * (x[part] - x[part].mean(axis=0)), axis=0) for x in (e.u, e.y)
            )
            cross.append(np.einsum('kp,km->kpm', y, u.conj()))
            power.append(np.einsum('kl,km->klm', u, u.conj()))
    frequency = np.fft.rfftfreq(size, dt)[1:]
    inverse = np.linalg.pinv(np.sum(power, axis=0)[1:], rcond=1e-12, hermitian=True)
    response = np.asarray(np.sum(cross, axis=0)[1:] @ inverse)
    s = 2j * np.pi * frequency * dt
    response[:, :, 0] /= ((1.0 - np.exp(-s)) / s)[:, np.newaxis]
    return np.asarray(frequency, dtype=np.float64), response
