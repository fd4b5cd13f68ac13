# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Square-root information: a triangle R and z, where R theta = z stands for all weighted rows.

Householder reflections add rows and keep R^T R exact (Bierman 1977, chapter V).

"""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np
from scipy.linalg import lapack

#: Standard deviation of every parameter before the first sample, in its SI unit. Robots have
#: parameters of 1e-4 to 1e3; a parameter that the data do not identify keeps this deviation.
PRIOR_STD = 1e6
#: Loss of information over that of exponential forgetting, as samples with little information lose
#: less. A step of the Coulomb friction of a moving 7-joint arm is followed as with exponential
#: forgetting: 63 % in 8 s and 90 % in 28 s with a memory of 10 s.
_LOSS_RATIO = 2.0
#: Largest share of the old information that one sample may remove in any direction [-].
_LARGEST_LOSS = 0.5
_BLOCK = 8  # columns of a Householder block; the fastest for 60 to 120 parameters


def solved(root: FloatArray, right: FloatArray) -> FloatArray:
    """Return theta of R theta = z, shape (P,)."""
    return np.asarray(lapack.dtrtrs(root, right)[0][:, 0])


def absorbed(
    root: FloatArray, right: FloatArray, rows: FloatArray, tau: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """
    Return R and z after new rows are added by Householder reflections.

    Parameters
    ----------
    root, right : ndarray, shapes (P, P) and (P, 1)
        R and z in Fortran order; they are overwritten.
    rows, tau : ndarray, shapes (m, P) and (m,)
        Rows to add, with noise of variance 1.

    """
    root, reflectors, factors, _ = lapack.dtpqrt(
        0, min(_BLOCK, len(root)), root, rows, overwrite_a=1
    )
    right, _, _ = lapack.dtpmqrt(
        0, reflectors, factors, right, tau[:, np.newaxis], trans='T', overwrite_a=1
    )
    return root, right


def replaced(root: FloatArray, rows: FloatArray, forgetting: float) -> FloatArray:
    """
    Return R with new information, discounting old information in the same directions.

    In the directions b of U = rows R^-1 = A diag(s) B^T the old information, 1, becomes
    1 - f + s^2 with f = min(s^2, level). It never falls, so the new triangle is the old one
    with rows A^T rows, shortened, annihilated. The level is such that the losses add up to
    the loss of exponential forgetting in all P directions, if the sample brings that much.

    Parameters
    ----------
    root : ndarray, shape (P, P)
        R in Fortran order; it is overwritten.
    rows : ndarray, shape (m, P)
        Rows to add, with noise of variance 1.
    forgetting : float
        Forgetting factor, below 1.

    """
    whitened, _ = lapack.dtrtrs(root, rows.T, trans=1)
    gains, directions = np.linalg.eigh(whitened.T @ whitened)
    budget = _LOSS_RATIO * (1.0 - forgetting) * len(root)
    # the level at which the gains, ascending and limited to it, add up to the budget
    some = np.maximum(gains, 0.0)
    levels = (budget - np.append(0.0, np.cumsum(some[:-1]))) / np.arange(len(some), 0, -1)
    above = some >= levels
    level = min(float(levels[np.argmax(above)]), _LARGEST_LOSS) if above.any() else _LARGEST_LOSS
    kept = np.sqrt(np.maximum(1.0 - level / np.maximum(gains, level), 0.0))
    if np.any(kept > 0.0):
        root, *_ = lapack.dtpqrt(
            0, min(_BLOCK, len(root)), root, (directions * kept).T @ rows, overwrite_a=1
        )
    return root


def step_along(root: FloatArray, gradient: FloatArray) -> FloatArray:
    """Return R^-1 R^-T times a gradient (P,)."""
    half, _ = lapack.dtrtrs(root, gradient[:, np.newaxis], trans=1)
    step, _ = lapack.dtrtrs(root, half)
    return np.asarray(step[:, 0])


def reopened(root: FloatArray, directions: FloatArray) -> FloatArray:
    """
    Return R without its information on parameters along some directions (P, k).

    The parameters become theta + directions delta, where nothing is known of delta: R theta = z
    is stacked with delta = 0 within PRIOR_STD, and delta is eliminated by reflections.

    """
    size, count = directions.shape
    unit = directions / np.linalg.norm(directions, axis=0)
    stacked = np.zeros((size + count, count + size))
    stacked[:size, :count], stacked[:size, count:] = -root @ unit, root
    stacked[size:, :count] = np.eye(count) / PRIOR_STD
    return np.asfortranarray(np.asarray(np.linalg.qr(stacked, mode='r'))[count:, count:])


def inverse_products(root: FloatArray) -> FloatArray:
    """Return R^-1 R^-T, the covariance for noise of variance 1, shape (P, P)."""
    inverse, _ = lapack.dtrtri(root)
    return np.asarray(inverse @ inverse.T)
