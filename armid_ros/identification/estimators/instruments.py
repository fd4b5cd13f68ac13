# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Instrumental variables: the regressor of a simulated arm correlates with the noise-free one alone.

Least squares of noisy columns W is biased by W' W, which has the square of the noise. With columns
Z of the fitted arm, simulated in closed loop along the smoothed motion, Z' (tau - W theta) = 0 has
not: Z knows nothing of the noise of encoders and torque sensors. Simulation and fit take turns.
Source: Janot, Vandanjon and Gautier 2014 (IDIM-IV).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.identification.assess.forward import unlimited
from armid_ros.identification.fitting.excited import bounds
from armid_ros.identification.fitting.least_squares import noise_products
from armid_ros.identification.fitting.nonlinear import (
    FittedValues,
    linearised,
    moved,
    torques,
    ungrouped,
)
from armid_ros.identification.fitting.triangle import within
from armid_ros.identification.rows.regression import filtered_columns, Regression
from armid_ros.identification.rows.signals import Conditioning, segments
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.simulation import ComputedTorque, Plant, simulate
import numpy as np
from scipy import signal
import scipy.linalg

#: The reference keeps this share of the band of the regressor, which is ten times the motion's.
_REFERENCE_SHARE = 0.2
#: Simulations; a linear arm settles after two.
_MOST_ROUNDS = 4
#: A change of less than this share of a standard deviation is the last.
_SETTLED = 0.02
#: An arm under computed torque that is off by more than this share of its motion is no arm.
_ASTRAY = 0.05


@dataclass(frozen=True)
class Instrumented:
    """
    Values by instruments.

    Attributes
    ----------
    values : ndarray, shape (r,)
        Parameters.
    covariance : ndarray, shape (r, r)
        Their covariance, correlation of the residuals included.

    """

    values: FloatArray
    covariance: FloatArray


def fit_by_instruments(
    fit: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
) -> tuple[FittedValues, tuple[str, ...]]:
    """
    Fit by instruments of a simulation, beginning from least squares.

    Parameters
    ----------
    fit : FittedValues
        Weighted least squares.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.

    Returns
    -------
    fit : FittedValues
        The fit by instruments.
    notes : tuple of str
        What a person should know of it.

    """
    notes, free = tuple[str, ...](), ungrouped(fit.arm, fit.base)
    base, now, simulated = fit.base, fit, True
    limits = bounds(fit.arm, base)
    for _ in range(_MOST_ROUNDS):
        try:
            columns = _simulated_columns(now, recordings, used)
        except ArmidError as error:
            simulated, columns = False, _smooth_columns(now, recordings, used)
            notes = (
                f'instruments are of the smoothed motion: the arm is not simulated ({error})',
            )
        found = by_instruments(now.problem, columns, fit.solution.weights, limits)
        step = np.abs(found.values - now.values) / np.sqrt(np.diag(found.covariance))
        arm = moved(now.arm, base, found.values, free)
        now = _at(now, arm, found.values, recordings, used)
        if np.max(step, initial=0.0) < _SETTLED or not simulated:
            break
    solution = replace(fit.solution, values=found.values, covariance=found.covariance)
    return replace(now, solution=solution), notes


def by_instruments(
    problem: Sequence[Regression],
    instruments: Sequence[FloatArray],
    weights: FloatArray,
    limits: tuple[FloatArray, FloatArray],
) -> Instrumented:
    """
    Solve Z' (tau - W theta) = 0.

    Parameters
    ----------
    problem : sequence of Regression
        N samples in all, with r columns W.
    instruments : sequence of ndarray, each of shape (M, n, r)
        Z at the same samples.
    weights : ndarray, shape (N, n)
        What the rows of both are multiplied by.
    limits : tuple of two ndarray, each of shape (r,)
        What is physically possible.

    Raises
    ------
    IdentificationError
        If the instruments do not correlate with the columns in every parameter.

    """
    rank = problem[0].columns.shape[2]
    rows = weights[:, :, np.newaxis]
    w = (rows * np.concatenate([part.columns for part in problem])).reshape(-1, rank)
    z = (rows * np.concatenate(instruments)).reshape(-1, rank)
    scale = np.linalg.norm(w, axis=0)
    w, z = w / scale, z / scale
    target = (weights * np.concatenate([part.target for part in problem])).ravel()
    try:
        solved = scipy.linalg.inv(z.T @ w)
        inverse = scipy.linalg.inv(np.linalg.qr(z, mode='r'))
    except scipy.linalg.LinAlgError:
        raise IdentificationError(
            'the simulated motion does not correlate with the recorded one in every parameter: '
            'use wls, or record a motion that shows more'
        ) from None
    (triangle,) = scipy.linalg.qr(w, mode='r', check_finite=False)
    triangle = triangle[:rank]
    values = within(solved @ (z.T @ target), triangle, (limits[0] * scale, limits[1] * scale))
    residual = (target - w @ values).reshape(weights.shape)
    scaled = [
        replace(part, columns=columns / scale)
        for part, columns in zip(problem, instruments, strict=True)
    ]
    products = noise_products(scaled, residual, weights, inverse)
    covariance = solved @ products @ solved.T
    return Instrumented(values / scale, covariance / np.outer(scale, scale))


def _smooth_reference(motion: Motion, cutoff_hz: float) -> Motion:
    """Return a motion from time zero on, its positions smoothed below a frequency."""
    period = float(motion.t[1] - motion.t[0])
    sections = signal.butter(4, min(0.9, 2.0 * cutoff_hz * period), output='sos')
    q = signal.sosfiltfilt(sections, motion.q, axis=0)
    dq = np.gradient(q, period, axis=0)
    return replace(
        motion, t=motion.t - motion.t[0], q=q, dq=dq, ddq=np.gradient(dq, period, axis=0)
    )


def _at_times(simulated: Motion, motion: Motion) -> Motion:
    """Return a simulated motion at the times of a recorded one, which begins at its zero."""
    t = motion.t - motion.t[0]
    q, dq, ddq = (
        np.column_stack([np.interp(t, simulated.t, column) for column in values.T])
        for values in (simulated.q, simulated.dq, simulated.ddq)
    )
    return replace(motion, q=q, dq=dq, ddq=ddq)


def _simulated_columns(
    fit: FittedValues, recordings: Sequence[Recording], used: Conditioning
) -> list[FloatArray]:
    """Return the columns of the arm along its own motion, simulated on the smoothed one."""
    arm, found = fit.arm, []
    for motion in _motions(recordings, used):
        reference = _smooth_reference(motion, _REFERENCE_SHARE * used.cutoff_hz)
        plant = Plant(unlimited(arm.along(reference)), hard_stops=False)
        run = simulate(
            plant, reference, rng=np.random.default_rng(0), controller=ComputedTorque(plant.arm)
        )
        along = _at_times(run.truth, motion)
        off = np.std(along.q - reference.q, axis=0) / np.maximum(np.std(reference.q, axis=0), 1e-9)
        if np.max(off) > _ASTRAY:
            joint = motion.joints[int(np.argmax(off))]
            raise IdentificationError(f'simulated, {joint} does not follow its reference')
        found.append(filtered_columns(arm, fit.base.independent, along, used))
    return found


def _smooth_columns(
    fit: FittedValues, recordings: Sequence[Recording], used: Conditioning
) -> list[FloatArray]:
    return [
        filtered_columns(
            fit.arm,
            fit.base.independent,
            replace(_smooth_reference(motion, _REFERENCE_SHARE * used.cutoff_hz), t=motion.t),
            used,
        )
        for motion in _motions(recordings, used)
    ]


def _motions(recordings: Sequence[Recording], used: Conditioning) -> list[Motion]:
    return [motion for recording in recordings for motion in segments(recording, used)]


def _at(
    fit: FittedValues,
    arm: ArmModel,
    values: FloatArray,
    recordings: Sequence[Recording],
    used: Conditioning,
) -> FittedValues:
    """Return a fit moved to other values, linearised there if its torque is not linear."""
    if fit.passes > 1:
        problem, predicted = linearised(arm, fit.base, recordings, used)
        return replace(fit, arm=arm, values=values, problem=problem, predicted=predicted)
    return replace(fit, arm=arm, values=values, predicted=torques(arm, recordings, used))
