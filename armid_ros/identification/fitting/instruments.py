# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Instrumental variables: the regressor of a smoothed motion, which has hardly any encoder noise.

Least squares with noisy columns W is biased, because W' W contains the squared noise. With
columns Z of a motion without encoder noise, the solution of Z' (tau - W theta) = 0 is unbiased.
The motion without noise is the recorded motion, smoothed to far below the band of the regressor.
Source: Young 2011; Janot, Vandanjon and Gautier 2014 for robots, with instruments of a simulation.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification.fitting.covariance import noise_products, sandwich
from armid_ros.identification.fitting.identifiability import bounds
from armid_ros.identification.fitting.least_squares import within
from armid_ros.identification.fitting.nonlinear import (
    FittedValues,
    linearised,
    moved,
    torques,
    ungrouped,
)
from armid_ros.identification.rows.regression import Regression, regressions, weighted_rows
from armid_ros.identification.rows.signals import Conditioning, unbroken
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy import signal
import scipy.linalg


@dataclass(frozen=True)
class Instrumented:
    """
    Estimate by instrumental variables.

    Attributes
    ----------
    values : ndarray, shape (r,)
        Parameters.
    covariance : ndarray, shape (r, r)
        Covariance of the parameters, correlation of the residuals included.
    difference : ndarray, shape (r,)
        Values by instruments minus those of least squares, both without bounds.
    spread : ndarray, shape (r, r)
        Covariance of the difference if the regressor has no noise.

    """

    values: FloatArray
    covariance: FloatArray
    difference: FloatArray
    spread: FloatArray


def fit_by_instruments(
    fit: FittedValues, recordings: Sequence[Recording], used: Conditioning
) -> FittedValues:
    """
    Fit by instrumental variables from the smoothed motion, starting at a weighted fit.

    Parameters
    ----------
    fit : FittedValues
        Weighted least squares.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.

    """
    base, free, linear = fit.base, ungrouped(fit.arm, fit.base), fit.passes == 1
    limits, calm, weights = bounds(fit.arm, base), smoothed(recordings, used), fit.solution.weights
    # the torque of an arm may be nonlinear in its parameters
    for _ in range(4):
        exact = linear_problem(fit.arm, base, calm, used, linear=linear)
        found = by_instruments(fit.problem, [part.columns for part in exact], weights, limits)
        step = np.abs(found.values - fit.values) / np.sqrt(np.diag(found.covariance))
        solution = replace(fit.solution, values=found.values, covariance=found.covariance)
        arm = moved(fit.arm, base, found.values, free)
        fit = replace(fit, arm=arm, values=found.values, solution=solution)
        if linear:
            return replace(fit, predicted=torques(arm, recordings, used))
        problem, predicted = linearised(arm, base, recordings, used)
        fit = replace(fit, problem=problem, predicted=predicted)
        if np.max(step, initial=0.0) < 0.02:  # standard deviations
            break
    return fit


def by_instruments(
    problem: Sequence[Regression],
    instruments: Sequence[FloatArray],
    weights: FloatArray,
    limits: tuple[FloatArray, FloatArray] | None = None,
) -> Instrumented:
    """
    Estimate theta by the instrumental-variable equation Z' (tau - W theta) = 0.

    Parameters
    ----------
    problem : sequence of Regression
        Stretches with N samples in total and r columns W.
    instruments : sequence of ndarray, each of shape (M, n, r)
        Z at the same samples.
    weights : ndarray, shape (N, n)
        Factors of the rows of W and Z.
    limits : tuple of two ndarray, each of shape (r,), optional
        Lower and upper bounds of physical values.

    Raises
    ------
    IdentificationError
        If the instruments do not correlate with the columns in every parameter.

    """
    w, target = weighted_rows(problem, weights)
    rank = w.shape[1]
    z = (weights[:, :, np.newaxis] * np.concatenate(instruments)).reshape(-1, rank)
    scale = np.linalg.norm(w, axis=0)
    w, z = w / scale, z / scale
    (triangle,) = scipy.linalg.qr(w, mode='r', check_finite=False)
    triangle = triangle[:rank]
    try:
        inverse = scipy.linalg.inv(triangle)
        by_w, by_z = inverse @ inverse.T, scipy.linalg.inv(z.T @ w)
    except scipy.linalg.LinAlgError:
        raise IdentificationError(
            'the smoothed motion does not correlate with the recorded one in every parameter: '
            'use wls, or record a richer motion'
        ) from None
    free = values = by_z @ (z.T @ target)
    if limits is not None:
        values = within(free, triangle, (limits[0] * scale, limits[1] * scale))
    residual = (target - w @ values).reshape(weights.shape)
    scaled = [replace(part, columns=part.columns / scale) for part in problem]
    further = [columns / scale for columns in instruments]
    products = noise_products(scaled, residual, weights, inverse, further)
    apart = np.concatenate([-by_w, by_z], axis=1)
    units = np.outer(scale, scale)
    return Instrumented(
        values=values / scale,
        covariance=sandwich(by_z, products[rank:, rank:]) / units,
        difference=(free - by_w @ (w.T @ target)) / scale,
        spread=apart @ products @ apart.T / units,
    )


def smoothed(recordings: Sequence[Recording], used: Conditioning) -> list[Recording]:
    """Return recordings with positions smoothed far below the cut-off of the regressor."""
    calm = []
    for recording in recordings:
        # band of the instruments over that of the regressor, which is ten times the band of the
        # motion
        cutoff = 0.2 * used.cutoff_hz * recording.period * 2.0
        sections = signal.butter(4, min(0.9, cutoff), output='sos')
        q = recording.q.copy()
        for part in unbroken(recording, 1.0 / recording.period):
            # padding of scipy: three times the length of the filter of two second-order sections
            edge = min(15, len(part) - 1)
            q[part] = signal.sosfiltfilt(sections, recording.q[part], axis=0, padlen=edge)
        calm.append(replace(recording, q=q, dq=None))
    return calm


def linear_problem(
    arm: ArmModel,
    base: BaseParameters,
    recordings: Sequence[Recording],
    used: Conditioning,
    *,
    linear: bool,
) -> Sequence[Regression]:
    """Return the linear problem of an arm, with a constant term if its torque is nonlinear."""
    if linear:
        return regressions(arm, base.independent, recordings, used)
    return linearised(arm, base, recordings, used)[0]
