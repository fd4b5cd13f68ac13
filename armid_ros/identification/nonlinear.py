# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Least squares of an arm whose torque need not be linear in its parameters, by Gauss-Newton.

Friction in proportion to the load, gains of torque sensors, zeros of encoders, gravity and
elasticity change the columns of everything else. A fit at the columns of the description is the
first step only: the arm is linearised again at what was found, until the torque that the linear
model promises is the torque of the arm. Steps that make the fit worse are halved.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.identification.excited import bounds
from armid_ros.identification.least_squares import Method, Solution, solve
from armid_ros.identification.regression import predictions, Regression, regressions
from armid_ros.identification.signals import Conditioning
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np
import scipy.linalg

#: Samples of a stretch along which the torque is looked at for curvature.
_SAMPLES = 2000
#: Curvature below this share of the torque is rounding.
_ROUNDING = 1e-9
#: Linear model and arm agree where they differ by less than this share of the residual ...
AGREED = 1e-4
#: ... or of the torque, where there is no noise.
_EXACT = 1e-8
#: Linearisations; fits that settle take three to eight.
MOST_PASSES = 20
#: Times that a step is halved before it is given up.
_HALVINGS = 8

Torques = tuple[FloatArray, ...]


@dataclass(frozen=True)
class FittedValues:
    """
    A fit, and the torque that the arm has with it.

    Attributes
    ----------
    arm : ArmModel
        The arm with the values.
    base : BaseParameters
        What the data tell apart.
    values : ndarray, shape (r,)
        Base parameters.
    problem : tuple of Regression
        The linear problem that gave them.
    solution : Solution
        Its solution: covariance, weights.
    predicted : tuple of ndarray, each of shape (M, n)
        Torque of the arm, filtered, for each stretch [N m].
    passes : int
        Linearisations that it took; 1 if the torque is linear.
    settled : bool
        Whether the linear model and the arm agree.

    """

    arm: ArmModel
    base: BaseParameters
    values: FloatArray
    problem: tuple[Regression, ...]
    solution: Solution
    predicted: Torques
    passes: int = 1
    settled: bool = True


def fit_values(
    arm: ArmModel,
    base: BaseParameters,
    problem: Sequence[Regression],
    recordings: Sequence[Recording],
    used: Conditioning,
    method: Method,
) -> FittedValues:
    """
    Fit base parameters, again and again where the torque is not linear in them.

    Parameters
    ----------
    arm : ArmModel
        Where to begin, and where what the data do not tell stays.
    base : BaseParameters
        What the data tell apart there.
    problem : sequence of Regression
        The columns there.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.
    method : {'ols', 'wls', 'irls'}
        As of ``solve``.

    """
    solution = solve(problem, method, bounds(arm, base))
    motions = [part.motion for part in problem]
    reached = moved(arm, base, solution.values)
    bare = arm.with_theta(np.where(np.arange(len(arm.theta)) < _rigid(arm), arm.theta, 0.0))
    if curved(bare, arm, motions):
        problem, _ = linearised(arm, base, recordings, used)
    elif not curved(arm, reached, motions):
        found = arm.with_theta(base.lift(solution.values, arm.theta))
        predicted = tuple(part.torque(solution.values) for part in problem)
        return FittedValues(found, base, solution.values, tuple(problem), solution, predicted)
    return _iterate(arm, base, problem, recordings, used, method)


def curved(before: ArmModel, after: ArmModel, motions: Sequence[Motion]) -> bool:
    """
    Tell whether the torque is not linear in the parameters between two arms of one structure.

    Parameters
    ----------
    before, after : ArmModel
        Two arms that differ in their values.
    motions : sequence of Motion
        What to look along.

    """
    if np.array_equal(before.theta, after.theta):
        return False
    middle = before.with_theta(0.5 * (before.theta + after.theta))
    for motion in motions:
        some = motion.select(slice(None, None, -(-len(motion) // _SAMPLES)))
        ends, half = (before.torque(some), after.torque(some)), middle.torque(some)
        size = max(float(np.max(np.abs(tau))) for tau in (*ends, half))
        if float(np.max(np.abs(ends[0] + ends[1] - 2.0 * half))) > _ROUNDING * size:
            return True
    return False


def moved(arm: ArmModel, base: BaseParameters, values: FloatArray) -> ArmModel:
    """
    Return an arm with other base parameters.

    Of what no motion tells apart, effects stay where they are and rigid parameters move as little
    as may be: what is grouped with rigid parameters alone is so wherever the effects are.

    """
    change = np.zeros(len(arm.theta))
    change[base.independent] = values - base.values(arm.theta)
    rigid = _rigid(arm)
    free = scipy.linalg.null_space(base.grouping[:, :rigid])
    change[:rigid] -= free @ (free.T @ change[:rigid])
    return arm.with_theta(arm.theta + change)


def linearised(
    arm: ArmModel, base: BaseParameters, recordings: Sequence[Recording], used: Conditioning
) -> tuple[tuple[Regression, ...], Torques]:
    """
    Linearise the torque of an arm about the values that it has.

    Returns
    -------
    problem : tuple of Regression
        With the constant that makes the linear model the arm's torque at its own values.
    predicted : tuple of ndarray, each of shape (M, n)
        That torque, filtered.

    """
    predicted = torques(arm, recordings, used)
    problem = regressions(arm, base.independent, recordings, used)
    return through(problem, predicted, base.values(arm.theta)), predicted


def torques(arm: ArmModel, recordings: Sequence[Recording], used: Conditioning) -> Torques:
    """Return the filtered torque of an arm along every stretch of recordings."""
    return tuple(part.torque for part in predictions(arm, recordings, used))


def through(
    problem: Sequence[Regression], predicted: Torques, values: FloatArray
) -> tuple[Regression, ...]:
    """Return linear models that have the predicted torque at the values."""
    return tuple(
        replace(part, constant=torque - part.columns @ values)
        for part, torque in zip(problem, predicted, strict=True)
    )


def agree(
    problem: Sequence[Regression], weights: FloatArray, promised: Torques, predicted: Torques
) -> bool:
    """Tell whether the torque of an arm is what a linear model promised, as far as it matters."""
    off = _size(weights, [p - q for p, q in zip(promised, predicted, strict=True)])
    whole = _size(weights, [part.tau for part in problem])
    return bool(off <= max(AGREED * np.sqrt(_cost(problem, weights, promised)), _EXACT * whole))


def _iterate(
    arm: ArmModel,
    base: BaseParameters,
    problem: Sequence[Regression],
    recordings: Sequence[Recording],
    used: Conditioning,
    method: Method,
) -> FittedValues:
    """Take Gauss-Newton steps until linear model and arm agree."""
    limits = bounds(arm, base)
    values = base.values(arm.theta)
    predicted = tuple(part.torque(values) for part in problem)
    found, passes = arm, 0
    while True:
        passes += 1
        solution = solve(problem, method, limits)
        weights = solution.weights
        promised = tuple(part.torque(solution.values) for part in problem)
        floor = _EXACT * _size(weights, [part.tau for part in problem])
        enough = _cost(problem, weights, predicted) + floor**2
        for halved in range(_HALVINGS):
            reached = values + 0.5**halved * (solution.values - values)
            trial = moved(arm, base, reached)
            torque = torques(trial, recordings, used)
            if _cost(problem, weights, torque) <= enough:
                found, values, predicted = trial, reached, torque
                break
        else:
            halved = _HALVINGS
        settled = agree(problem, weights, promised, predicted)
        if settled or halved == _HALVINGS or passes == MOST_PASSES:
            break
        fresh = regressions(found, base.independent, recordings, used)
        problem = through(fresh, predicted, values)
    return FittedValues(
        found, base, values, tuple(problem), solution, predicted, max(passes, 2), settled
    )


def _rigid(arm: ArmModel) -> int:
    return len(arm.robot.rigid_parameters)


def _cost(problem: Sequence[Regression], weights: FloatArray, predicted: Torques) -> float:
    left = [part.tau - torque for part, torque in zip(problem, predicted, strict=True)]
    return _size(weights, left) ** 2


def _size(weights: FloatArray, torque: Sequence[FloatArray]) -> float:
    return float(np.linalg.norm(weights * np.concatenate(torque)))
