# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Closed-loop output error: the arm is simulated, and its parameters make the simulation right.

The simulated arm gets the recorded torques, and a feedback that holds it to the recorded motion.
An arm without error needs no feedback; the parameters are those that need least. The columns are
those of the simulated motion, which has no encoder noise but what the feedback lets through, and
the feedback follows a torque error below its bandwidth: f = T (Y theta - tau), where
T = (2 omega s + omega^2) / (s + omega)^2. So each Gauss-Newton step is a linear least squares.
Source: Gautier, Janot and Vandanjon 2013 (DIDIM), with the recorded torque in place of a
controller that a recording does not tell.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.identification.assess.forward import BANDWIDTH, driven
from armid_ros.identification.estimators.instruments import at_times
from armid_ros.identification.fitting.excited import bounds
from armid_ros.identification.fitting.least_squares import Solution, solve
from armid_ros.identification.fitting.nonlinear import FittedValues, moved, torques
from armid_ros.identification.rows.regression import filtered_columns, Regression
from armid_ros.identification.rows.signals import Conditioning, decimate, segments
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np
from scipy import signal

#: Gauss-Newton steps; fits that settle take two to five.
_MOST_STEPS = 8
#: Halvings of a step that makes the simulation worse, or no simulation at all.
_HALVINGS = 5
#: A step that gains less than this share of the squares is the last.
_LITTLE = 1e-3


def fit_output_error(
    fit: FittedValues,
    recordings: Sequence[Recording],
    used: Conditioning,
    free: FloatArray,
) -> tuple[FittedValues, tuple[str, ...]]:
    """
    Fit by closed-loop output error, beginning from an arm that can be simulated.

    Parameters
    ----------
    fit : FittedValues
        Where to begin.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.
    free : ndarray, shape (10 n, k)
        Directions of the rigid parameters that change no torque.

    Returns
    -------
    fit : FittedValues
        The fit.
    notes : tuple of str
        What a person should know of it.

    Raises
    ------
    IdentificationError
        If the arm cannot be simulated to begin with.

    """
    loop = _Loop(fit, recordings, used)
    limits = bounds(fit.arm, fit.base)
    arm, values = fit.arm, fit.values
    try:
        problem = loop.problem(arm, values)
    except ArmidError as error:
        raise IdentificationError(f'cloe simulates the arm, which fails: {error}') from None
    solution = solve(problem, 'wls', limits)
    settled, notes = False, tuple[str, ...]()
    for _ in range(_MOST_STEPS):
        cost = _cost(problem, values, solution)
        for halving in range(_HALVINGS):
            trial = values + 0.5**halving * (solution.values - values)
            candidate = moved(arm, fit.base, trial, free)
            try:
                after = loop.problem(candidate, trial)
            except ArmidError:
                continue
            gain = cost - _cost(after, trial, solution)
            if gain > -_LITTLE * cost:
                break
        else:
            notes = ('cloe stopped where no step makes the simulation better',)
            break
        settled = gain < _LITTLE * cost
        arm, values, problem = candidate, trial, after
        solution = solve(problem, 'wls', limits)
        if settled:
            break
    return (
        replace(
            fit,
            arm=arm,
            values=values,
            solution=solution,
            predicted=torques(arm, recordings, used),
            settled=settled or bool(notes),
        ),
        notes,
    )


class _Loop:
    """
    The simulation along training data, as a linear problem of the simulated motion.

    Parameters
    ----------
    fit : FittedValues
        Gives the feedback, and which rows say something.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.

    """

    def __init__(
        self, fit: FittedValues, recordings: Sequence[Recording], used: Conditioning
    ) -> None:
        self._fit, self._used = fit, used
        self._motions = [motion for r in recordings for motion in segments(r, used)]
        rate = used.rate_hz / used.decimation
        self._filter = signal.bilinear(
            [2.0 * BANDWIDTH, BANDWIDTH**2], np.poly([-BANDWIDTH, -BANDWIDTH]), fs=rate
        )

    def problem(self, arm: ArmModel, values: FloatArray) -> list[Regression]:
        """Simulate, and return what the feedback says of the parameters, linear about values."""
        return [
            self._linear(arm, values, motion, part)
            for motion, part in zip(self._motions, self._fit.problem, strict=True)
        ]

    def _linear(
        self, arm: ArmModel, values: FloatArray, motion: Motion, part: Regression
    ) -> Regression:
        reference = replace(motion, t=motion.t - motion.t[0])
        run, controller = driven(arm.along(reference), reference, self._fit.arm)
        assert run.truth.tau is not None
        feedback = run.truth.tau - controller.feedforward(run.truth)
        t = motion.t - motion.t[0]
        feedback = np.column_stack([np.interp(t, run.truth.t, f) for f in feedback.T])
        along = at_times(run.truth, motion)
        columns = filtered_columns(arm, self._fit.base.independent, along, self._used)
        columns = signal.lfilter(*self._filter, columns, axis=0)
        target = columns @ values - decimate(feedback, self._used)
        return replace(
            part, motion=part.motion.with_torque(target), columns=columns, constant=None
        )


def _cost(problem: Sequence[Regression], values: FloatArray, solution: Solution) -> float:
    """Return the weighted squares of the feedback at values."""
    left = np.concatenate([part.target - part.columns @ values for part in problem])
    return float(np.sum((solution.weights * left) ** 2))
