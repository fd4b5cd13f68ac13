# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
How far off the torque of each joint is, in what a model can be asked for.

Errors of joints are shares of their own torque: a slide takes newtons and a wrist newton metres,
and their sum has no unit. No model predicts white noise of a torque, or where in its dry friction
a joint is that rests.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.rows.checks import moving
from armid_ros.identification.rows.regression import Fit
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import FloatArray
import numpy as np
from scipy import stats


def beyond_noise(errors: FloatArray, fits: Sequence[Fit], used: Conditioning) -> FloatArray:
    """
    Return what is left of errors of joints without the noise of their torques.

    Noise counts twice: a row has it, and so has the prediction of a row, where that is as sure as
    a measurement of it (leverage of one, Hoaglin and Welsch 1978). A model that is no further off
    than a sensor is not what is wrong.

    Parameters
    ----------
    errors : ndarray, shape (n,)
        Norm of the residual of each joint over that of its torque [%].
    fits : sequence of Fit
        Where they come from.
    used : Conditioning
        Filters of the rows.

    Returns
    -------
    ndarray, shape (n,)
        The same without the noise [%]; zero of a joint that rests throughout.

    """
    told = np.concatenate([fit.informative for fit in fits])
    torque = told * np.concatenate([_torque(fit) for fit in fits])
    rows = np.maximum(np.count_nonzero(told, axis=0), 1)
    size = np.sqrt(np.sum(torque**2, axis=0) / rows)
    noise = np.divide(torque_noise(fits, used), size, out=np.zeros_like(size), where=size > 0.0)
    left = np.sqrt(np.maximum(np.square(errors) - 2.0 * np.square(100.0 * noise), 0.0))
    return np.where(moving(fit.motion for fit in fits), left, 0.0)


def torque_noise(fits: Sequence[Fit], used: Conditioning) -> FloatArray:
    """
    Return the standard deviation of the white noise in rows of measured torque, (n,) [N m].

    It shows in second differences (Gasser, Sroka and Jennen-Steinmetz 1986), whose deviation is
    taken from their median: what the motion makes of a torque changes little from row to row, and
    friction steps in few of them.

    """
    parts = [np.abs(np.diff(_torque(fit), 2, axis=0)) for fit in fits]
    differences = np.concatenate(parts)
    if not len(differences):
        return np.zeros(fits[0].motion.n_joints)
    deviation = np.median(differences, axis=0) / float(stats.norm.ppf(0.75))
    # the variance of second differences of rows over that of rows, of white noise
    taps, step = used.taps(), used.decimation
    own, next_one, after = (
        float(taps[: len(taps) - lag] @ taps[lag:]) if lag < len(taps) else 0.0
        for lag in (0, step, 2 * step)
    )
    return np.asarray(deviation / np.sqrt((6.0 * own - 8.0 * next_one + 2.0 * after) / own))


def _torque(fit: Fit) -> FloatArray:
    assert fit.motion.tau is not None
    return fit.motion.tau
