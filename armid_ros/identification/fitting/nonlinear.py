# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Least squares by Gauss-Newton for an arm whose torque may be nonlinear in its parameters.

Friction in proportion to the load, gains of torque sensors, zeros of encoders, gravity and
elasticity change the columns of all other parameters. A fit with the columns of the description
is therefore only the first step. The model of the arm is linearised again at the fitted values
until the linear and the nonlinear model have the same torque. Steps that worsen the fit are
halved.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.identification.fitting.identifiability import bounds
from armid_ros.identification.fitting.least_squares import Method, Solution, solve
from armid_ros.identification.rows.regression import (
    Fit,
    predictions,
    Regression,
    regressions,
)
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.model import BaseParameters, LINK_PARAMETERS
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import NO_MASS
import numpy as np
import scipy.linalg

#: Smallest relevant share of the torque, where there is no noise.
_MIN_TORQUE_SHARE = 1e-8
#: Largest number of linearisations; fits that converge take three to eight.
_MAX_PASSES = 20

Torques = tuple[FloatArray, ...]


@dataclass(frozen=True)
class FittedValues:
    """
    Fitted base parameters, the arm model with these values, and the torque of this model.

    Attributes
    ----------
    arm : ArmModel
        The arm model with the fitted values.
    base : BaseParameters
        Base parameters that the data identify.
    values : ndarray, shape (r,)
        Values of the base parameters.
    problem : tuple of Regression
        Linear problem of the last step.
    solution : Solution
        Solution of the linear problem: covariance, weights.
    predicted : tuple of ndarray, each of shape (M, n)
        Torque of the arm, filtered, for each stretch [N m].
    passes : int
        Number of linearisations; 1 if the torque is linear.
    converged : bool
        Whether the torques of the linear and the nonlinear model agree.

    """

    arm: ArmModel
    base: BaseParameters
    values: FloatArray
    problem: tuple[Regression, ...]
    solution: Solution
    predicted: Torques
    passes: int = 1
    converged: bool = True

    @property
    def fits(self) -> tuple[Fit, ...]:
        """Measured and predicted torques of the training data, for each gap-free section."""
        return tuple(
            Fit(part.source, part.motion, part.informative, torque)
            for part, torque in zip(self.problem, self.predicted, strict=True)
        )


def fit_values(
    arm: ArmModel,
    base: BaseParameters,
    problem: Sequence[Regression],
    recordings: Sequence[Recording],
    used: Conditioning,
    method: Method,
    free: FloatArray | None = None,
    solution: Solution | None = None,
) -> FittedValues:
    """
    Fit base parameters by linear least squares, or by Gauss-Newton if the arm is nonlinear.

    Parameters
    ----------
    arm : ArmModel
        Start of the fit; parameters that the data do not determine keep the values of this model.
    base : BaseParameters
        Base parameters that the data identify at the start.
    problem : sequence of Regression
        Columns of `base` at the start.
    recordings : sequence of Recording
        Training data.
    used : Conditioning
        Filters.
    method : {'ols', 'wls', 'irls'}
        See ``solve``.
    free : ndarray, shape (10 n, k), optional
        Orthonormal directions of the rigid parameters that change no torque; by default, all that
        `base` does not identify.
    solution : Solution, optional
        Solution of `problem`, if known.

    """
    solution = solution or solve(problem, method, bounds(arm, base))
    motions = [part.motion for part in problem]
    chosen = unidentifiable_directions(arm, base) if free is None else free
    reached = with_base_values(arm, base, solution.values, chosen)
    bare = arm.with_theta(
        np.where(np.arange(len(arm.theta)) < len(arm.robot.rigid_parameters), arm.theta, 0.0)
    )
    if is_nonlinear(bare, arm, motions):
        problem, _ = linearised(arm, base, recordings, used)
    elif not is_nonlinear(arm, reached, motions):
        predicted = tuple(part.torque(solution.values) for part in problem)
        # parameters nearest to the description, if they have the fitted torque along this motion
        nearest = arm.with_theta(base.lift(solution.values, arm.theta))
        rigid = len(arm.robot.rigid_parameters)
        if free is None and (
            np.allclose(nearest.theta[rigid:], reached.theta[rigid:])
            or agree(problem, solution.weights, predicted, torques(nearest, recordings, used))
        ):
            reached = nearest
        return FittedValues(reached, base, solution.values, tuple(problem), solution, predicted)
    return _iterate(arm, base, problem, recordings, used, method, chosen)


def is_nonlinear(before: ArmModel, after: ArmModel, motions: Sequence[Motion]) -> bool:
    """
    Return whether torques are nonlinear in the parameters between two models of an arm.

    Parameters
    ----------
    before, after : ArmModel
        Two models of an arm that differ in their values.
    motions : sequence of Motion
        Motions along which torques are computed.

    """
    if np.array_equal(before.theta, after.theta):
        return False
    middle = before.with_theta(0.5 * (before.theta + after.theta))
    for motion in motions:
        # at most 2000 samples of a stretch
        some = motion.select(slice(None, None, -(-len(motion) // 2000)))
        ends, half = (before.torque(some), after.torque(some)), middle.torque(some)
        size = max(float(np.max(np.abs(tau))) for tau in (*ends, half))
        # a smaller nonlinear share of the torque is a rounding error
        if float(np.max(np.abs(ends[0] + ends[1] - 2.0 * half))) > 1e-9 * size:
            return True
    return False


def with_base_values(
    arm: ArmModel, base: BaseParameters, values: FloatArray, free: FloatArray
) -> ArmModel:
    """
    Return the arm model with given values of its base parameters.

    In unidentifiable directions, effects keep their values and inertial parameters change as
    little as possible: these directions are unidentifiable with any effects.

    Parameters
    ----------
    arm : ArmModel
        Model with the present values.
    base : BaseParameters
        The base parameters that are identifiable.
    values : ndarray, shape (r,)
        Base parameters of the returned arm.
    free : ndarray, shape (10 n, k)
        Orthonormal directions of the rigid parameters that change no torque.

    """
    change = np.zeros(len(arm.theta))
    change[base.independent] = values - base.values(arm.theta)
    rigid = len(arm.robot.rigid_parameters)
    change[:rigid] -= free @ (free.T @ change[:rigid])
    theta = arm.theta + change
    links = theta[:rigid].reshape(-1, len(LINK_PARAMETERS))
    lacking = (np.abs(links[:, 0]) < NO_MASS) & np.any(np.abs(links[:, 1:4]) >= NO_MASS, axis=1)
    if np.any(lacking):
        # The fit gave a first moment to a link without described mass. The mass of this link is
        # not identifiable: with suitable changes of previous links, it changes no torque.
        mass = np.zeros_like(links)
        # the centre of mass of such a link is assumed 0.2 m away
        mass[lacking, 0] = np.linalg.norm(links[lacking, 1:4], axis=1) / 0.2
        theta[:rigid] += free @ (free.T @ mass.ravel())
    return arm.with_theta(theta)


def linearised(
    arm: ArmModel, base: BaseParameters, recordings: Sequence[Recording], used: Conditioning
) -> tuple[tuple[Regression, ...], Torques]:
    """
    Return the linearised torque of an arm model at its parameters, and the torque itself.

    Returns
    -------
    problem : tuple of Regression
        Linear model that has the torque of the arm model at these values.
    predicted : tuple of ndarray, each of shape (M, n)
        Torque of the arm model, filtered [N m].

    """
    predicted = torques(arm, recordings, used)
    problem = regressions(arm, base.independent, recordings, used)
    return exact_at(problem, predicted, base.values(arm.theta)), predicted


def torques(arm: ArmModel, recordings: Sequence[Recording], used: Conditioning) -> Torques:
    """Return the filtered torque of an arm model along each gap-free section of recordings."""
    return tuple(part.predicted for part in predictions(arm, recordings, used))


def exact_at(
    problem: Sequence[Regression], predicted: Torques, values: FloatArray
) -> tuple[Regression, ...]:
    """Return linear problems whose constants let `values` predict the torques `predicted`."""
    return tuple(
        replace(part, constant=torque - part.columns @ values)
        for part, torque in zip(problem, predicted, strict=True)
    )


def agree(
    problem: Sequence[Regression], weights: FloatArray, linear: Torques, predicted: Torques
) -> bool:
    """Return whether torques of the linear and the nonlinear model agree within tolerance."""
    measured = [part.tau for part in problem]
    difference, torque, residual = (
        float(np.linalg.norm(weights * np.concatenate(parts)))
        for parts in (
            [one - other for one, other in zip(linear, predicted, strict=True)],
            measured,
            [tau - one for tau, one in zip(measured, linear, strict=True)],
        )
    )
    # a smaller share of the residual, or of the torque, is irrelevant
    return difference <= max(1e-4 * residual, _MIN_TORQUE_SHARE * torque)


def _iterate(
    arm: ArmModel,
    base: BaseParameters,
    problem: Sequence[Regression],
    recordings: Sequence[Recording],
    used: Conditioning,
    method: Method,
    free: FloatArray,
) -> FittedValues:
    """Take Gauss-Newton steps until the linear and the nonlinear model agree."""
    limits = bounds(arm, base)
    now = _State(arm, base.values(arm.theta), problem)
    for passes in range(1, _MAX_PASSES + 1):
        solution = solve(now.problem, method, limits)
        linear = tuple(part.torque(solution.values) for part in now.problem)
        # decrease of the cost that corresponds to one standard deviation of one parameter
        converged = passes > 1 and abs(now.gain(linear)) < 1.0
        if converged:
            break
        trial: _State | None = None
        for share in 0.5 ** np.arange(24):  # of the step
            values = now.values + share * (solution.values - now.values)
            stepped = with_base_values(now.arm, base, values, free)
            predicted = torques(stepped, recordings, used)
            if now.cost(predicted) <= now.cost():
                trial = _State(stepped, values, exact_at(now.problem, predicted, values))
                break
        if trial is None:
            # largest unattained decrease, as a share of the cost, of a fit that has converged
            converged = now.gain(linear) < 0.5 * now.cost()
            break
        converged = agree(now.problem, solution.weights, linear, trial.predicted)
        # decrease of the cost by a step below which the iteration ends
        converged = converged or now.gain(trial.predicted) < 0.1
        if converged or passes == _MAX_PASSES:
            now = trial
            break
        fresh = regressions(trial.arm, base.independent, recordings, used)
        now = _State(trial.arm, trial.values, exact_at(fresh, trial.predicted, trial.values))
    return FittedValues(
        now.arm, base, now.values, now.problem, solution, now.predicted, max(passes, 2), converged
    )


class _State:
    """State of a Gauss-Newton iteration: arm model, parameters, linear problem, residual."""

    def __init__(self, arm: ArmModel, values: FloatArray, problem: Sequence[Regression]) -> None:
        self.arm, self.values, self.problem = arm, values, tuple(problem)
        self.predicted = tuple(part.torque(values) for part in problem)
        self._tau = np.concatenate([part.tau for part in problem])
        self._used = np.concatenate([part.informative for part in problem])
        self._residual = self._tau - np.concatenate(self.predicted)
        counts = np.maximum(self._used.sum(axis=0), 1)
        rms = np.sqrt(np.sum(self._residual**2, axis=0, where=self._used) / counts)
        self._weights = self._used / np.maximum(rms, _MIN_TORQUE_SHARE * max(rms.max(), 1e-100))

    def gain(self, predicted: Torques) -> float:
        """Return the decrease of the cost by torques `predicted`; zero if the fit is exact."""
        # a smaller residual torque is a rounding error
        if np.linalg.norm(self._used * self._residual) <= 1e-6 * np.linalg.norm(
            self._used * self._tau
        ):
            return 0.0
        return self.cost() - self.cost(predicted)

    def cost(self, predicted: Torques | None = None) -> float:
        """Return the sum of squared residuals, in units of the present rms error of each joint."""
        if predicted is None:
            return float(np.sum((self._weights * self._residual) ** 2))
        residual = self._weights * (self._tau - np.concatenate(predicted))
        return float(np.sum(residual**2))


def unidentifiable_directions(arm: ArmModel, base: BaseParameters) -> FloatArray:
    """Return orthonormal changes (10 n, k) of inertial parameters that change no torque."""
    return np.asarray(scipy.linalg.null_space(base.grouping[:, : len(arm.robot.rigid_parameters)]))
