# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Instrumental variables: the regressor of another motion correlates with the noise-free one alone.

Least squares of noisy columns W is biased by W' W, which has the square of the noise. With columns
Z of a motion that knows nothing of the noise of encoders and torque sensors,
Z' (tau - W theta) = 0 has not. Such motions are the recorded one, smoothed far below the band of
the regressor, and that of the fitted arm, simulated in closed loop along it. Simulation and fit
take turns.
Source: Janot, Vandanjon and Gautier 2014 (IDIM-IV).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.identification.fitting.covariance import noise_products, sandwich
from armid_ros.identification.fitting.excited import bounds
from armid_ros.identification.fitting.nonlinear import (
    FittedValues,
    linearised,
    moved,
    torques,
    ungrouped,
)
from armid_ros.identification.fitting.normal_equations import within
from armid_ros.identification.rows.regression import (
    filtered_columns,
    Regression,
    regressions,
    weighted_rows,
)
from armid_ros.identification.rows.signals import Conditioning, segments, unbroken
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.simulation import ComputedTorque, Plant, simulate
import numpy as np
from scipy import signal
import scipy.linalg

#: Instruments keep this share of the band of the regressor, which is ten times the motion's.
_SHARE = 0.2
#: Samples that a stretch is continued by at its ends at the most: three times the length of the
#: filter, two sections of second order, as scipy does where nothing is said.
_EDGE = 15
#: Simulations; a linear arm settles after two.
_MOST_ROUNDS = 4
#: A change of less than this share of a standard deviation is the last.
_SETTLED = 0.02
#: An arm under computed torque that is off by more than this share of its motion is no arm.
_ASTRAY = 0.05
#: Far enough for no joint to be at a limit [rad or m].
_FAR = 1e4


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
    difference : ndarray, shape (r,)
        Values by instruments minus those of least squares, both without limits.
    spread : ndarray, shape (r, r)
        Covariance of the difference where the regressor has no noise.

    """

    values: FloatArray
    covariance: FloatArray
    difference: FloatArray
    spread: FloatArray


def fit_by_instruments(
    arm: ArmModel,
    fit: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
) -> tuple[FittedValues, tuple[str, ...]]:
    """
    Fit by instruments of a simulation, beginning from least squares.

    Parameters
    ----------
    arm : ArmModel
        The description.
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

    Raises
    ------
    IdentificationError
        If the description is quasi-static: it has no inertia to simulate.

    """
    if arm.quasi_static:
        raise IdentificationError(
            'iv simulates the arm, and a quasi-static model has no inertia; use wls'
        )
    notes, free = tuple[str, ...](), ungrouped(fit.arm, fit.base)
    base, now, simulated = fit.base, fit, True
    limits = bounds(fit.arm, base)
    calm = smoothed(recordings, used)
    for _ in range(_MOST_ROUNDS):
        try:
            columns = _simulated_columns(now, calm, used)
        except ArmidError as error:
            along = linear_problem(now.arm, base, calm, used, linear=now.passes == 1)
            simulated, columns = False, [part.columns for part in along]
            notes = (
                f'instruments are of the smoothed motion: the arm is not simulated ({error})',
            )
        found = by_instruments(now.problem, columns, fit.solution.weights, limits)
        step = np.abs(found.values - now.values) / np.sqrt(np.diag(found.covariance))
        arm = moved(now.arm, base, found.values, free)
        if now.passes > 1:
            problem, predicted = linearised(arm, base, recordings, used)
        else:
            problem, predicted = now.problem, torques(arm, recordings, used)
        now = replace(now, arm=arm, values=found.values, problem=problem, predicted=predicted)
        if np.max(step, initial=0.0) < _SETTLED or not simulated:
            break
    solution = replace(fit.solution, values=found.values, covariance=found.covariance)
    return replace(now, solution=solution), notes


def by_instruments(
    problem: Sequence[Regression],
    instruments: Sequence[FloatArray],
    weights: FloatArray,
    limits: tuple[FloatArray, FloatArray] | None = None,
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
    limits : tuple of two ndarray, each of shape (r,), optional
        What is physically possible.

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
            'the simulated motion does not correlate with the recorded one in every parameter: '
            'use wls, or record a motion that shows more'
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
        cutoff = _SHARE * used.cutoff_hz * recording.period * 2.0
        sections = signal.butter(4, min(0.9, cutoff), output='sos')
        q = recording.q.copy()
        for part in unbroken(recording, 1.0 / recording.period):
            edge = min(_EDGE, len(part) - 1)
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
    """Return the linear problem of an arm, with a constant where its torque is not linear."""
    if linear:
        return regressions(arm, base.independent, recordings, used)
    return linearised(arm, base, recordings, used)[0]


def _simulated_columns(
    fit: FittedValues, calm: Sequence[Recording], used: Conditioning
) -> list[FloatArray]:
    """Return the columns of the arm along its own motion, simulated on the smoothed one."""
    arm, found = fit.arm, []
    for motion in (part for recording in calm for part in segments(recording, used)):
        t = motion.t - motion.t[0]
        reference = replace(motion, t=t)
        plant = Plant(unlimited(arm.along(reference)), hard_stops=False)
        controller = ComputedTorque(plant.arm)
        run = simulate(plant, reference, rng=np.random.default_rng(0), controller=controller).truth
        q, dq, ddq = (
            np.column_stack([np.interp(t, run.t, column) for column in values.T])
            for values in (run.q, run.dq, run.ddq)
        )
        off = np.std(q - motion.q, axis=0) / np.maximum(np.std(motion.q, axis=0), 1e-9)
        if np.max(off) > _ASTRAY:
            joint = motion.joints[int(np.argmax(off))]
            raise IdentificationError(f'simulated, {joint} does not follow its reference')
        along = replace(motion, q=q, dq=dq, ddq=ddq)
        found.append(filtered_columns(arm, fit.base.independent, along, used))
    return found


def unlimited(arm: ArmModel) -> ArmModel:
    """Return an arm whose joints have no limits that a simulation could run into."""
    n = arm.robot.n_joints
    far, free = np.full(n, _FAR), np.full(n, np.inf)
    robot = replace(arm.robot, lower=-far, upper=far, velocity_limit=free, torque_limit=free)
    return replace(arm, robot=robot)
