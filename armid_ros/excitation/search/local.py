# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One search: from the best of some random trajectories to a local optimum inside every limit.

The solver is SLSQP of SciPy, sequential quadratic programming; docs/excitation.md compares it
with others. It works on samples; after each round the result is examined between them, and where
something is wrong there the time is added to those that the next round looks at.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import Generic, TypeVar

from armid_ros.excitation.feasibility import Faults, trajectory_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.random_trajectory import position_range, random_feasible
from armid_ros.excitation.search.constraints import Constraints
from armid_ros.excitation.search.objective import Objective
from armid_ros.motion import FloatArray
import numpy as np
import scipy.optimize

#: Sharpness of the soft maximum, coarse for as long as that gains anything, then fine.
_SHARPNESS = (60.0, 300.0)

#: Iterations of a round, and the gain of one below which the search has settled.
_ROUND, _SETTLED = 25, 0.01

#: Half width of the box a round may not leave, in units of the coefficients' scale.
_BOX = 0.5

#: Share of every limit that the solver keeps free, and clearance on top of the margin [m].
_RESERVE, _SLACK = 0.002, 0.001

#: Samples of a period among which bodies too near are looked for after a round, per harmonic.
_CHECK = 200

#: Poses in which a pair of bodies has to come nearer than the margin and this [m] for the solver
#: to look at it; the proof of clearance looks at all.
_POSES, _WATCHED = 1000, 0.01

#: Joints up to which a search draws all its candidates; the time of each grows with the joints.
_CANDIDATE_JOINTS = 10

#: Factor by which a trajectory that is not quite feasible is made smaller, and how often.
_SHRINK, _SHRINKS = 0.99, 12

#: Stands in for an infinite cost, which a line search cannot work with.
_NO_COST = 1e3

_Result = TypeVar('_Result')


@dataclass(frozen=True)
class Found:
    """
    What a search has found.

    Attributes
    ----------
    trajectory : FourierTrajectory
        Feasible, at and between all samples.
    cost : float
        Its cost.

    """

    trajectory: FourierTrajectory
    cost: float


#: Receives the share of the work that is done, and the best so far.
Watch = Callable[[float, Found], None]


@dataclass
class _Best:
    """The best feasible trajectory so far, and who wants to know."""

    problem: DesignProblem
    prior: FloatArray | None
    watch: Watch
    found: Found | None = None
    done: float = 0.0

    def offer(self, trajectory: FourierTrajectory) -> float:
        """Take a feasible trajectory into account; return what it gains."""
        cost = exact_cost(self.problem, trajectory, self.prior)
        gain = np.inf if self.found is None else self.found.cost - cost
        if gain > 0.0:
            self.found = Found(trajectory, cost)
        self.tell(self.done)
        return gain

    def tell(self, done: float) -> None:
        self.done = done
        if self.found is not None:
            self.watch(done, self.found)


class Stopped(Exception):
    """Raised by what watches a search to end it."""


def search(
    problem: DesignProblem,
    clearance: ClearanceModel | None,
    prior: FloatArray | None,
    rng: np.random.Generator,
    watch: Watch,
) -> Found:
    """
    Search once.

    Parameters
    ----------
    problem : DesignProblem
        What is wanted.
    clearance : ClearanceModel or None
        Bodies to keep apart.
    prior : ndarray, shape (r, r), or None
        Information that is there already.
    rng : Generator
        Source of randomness.
    watch : callable
        Receives the share done and the best so far; may raise Stopped to end the search with that.

    Raises
    ------
    TrajectoryError
        If nothing is feasible.

    """
    best = _Best(problem, prior, watch)
    objective = Objective.of(problem, prior)
    try:
        start = _best_of_random(problem, clearance, rng, best)
        _improve(objective, clearance, start, best, rng)
    except Stopped:
        pass
    assert best.found is not None
    return best.found


def exact_cost(
    problem: DesignProblem, trajectory: FourierTrajectory, prior: FloatArray | None
) -> float:
    """Return the cost with the true direction of motion and many samples."""
    settings = problem.settings
    count = 4 * settings.samples
    w = problem.periodic_columns(trajectory, count)[:, problem.selected]
    weight = settings.rate * settings.period * settings.n_periods / count
    matrix = weight * (w.T @ w)
    return problem.criterion.cost(matrix if prior is None else matrix + prior)


def _best_of_random(
    problem: DesignProblem,
    clearance: ClearanceModel | None,
    rng: np.random.Generator,
    best: _Best,
) -> FourierTrajectory:
    settings = problem.settings
    share = min(1.0, _CANDIDATE_JOINTS / problem.arm.robot.n_joints)
    for _ in range(math.ceil(share * settings.candidates)):
        best.offer(
            random_feasible(
                problem.arm,
                problem.limits,
                settings.period,
                settings.harmonics,
                rng,
                collision=clearance,
                margin=settings.clearance,
            )
        )
    assert best.found is not None
    return best.found.trajectory


def _improve(
    objective: Objective,
    clearance: ClearanceModel | None,
    start: FourierTrajectory,
    best: _Best,
    rng: np.random.Generator,
) -> None:
    """Run the solver in rounds, within a box about the last trajectory that was feasible."""
    problem = objective.problem
    settings = problem.settings
    scale = _coefficient_scale(problem.limits, settings.period, settings.harmonics)
    lower, upper = _coefficient_range(problem.limits, scale)
    watched = _watched(problem, clearance, rng)
    x = start.coefficients / scale
    left, times, box, sharpness = settings.iterations, np.empty(0), _BOX, _SHARPNESS[0]
    while left > 0:
        constraints = Constraints.of(
            problem,
            watched,
            margin=settings.clearance + _SLACK,
            reserve=_RESERVE,
            sharpness=sharpness,
            more_times=times,
        )

        def step(count: int, before: float = best.done) -> None:
            best.tell(before + count / settings.iterations)

        z, used = _solve(
            objective,
            constraints,
            scale,
            x,
            (np.maximum(lower, x - box), np.minimum(upper, x + box)),
            min(_ROUND, left),
            step,
        )
        left -= used
        trajectory = FourierTrajectory.of(problem.limits.joints, settings.period, z * scale)
        more = _faulty_times(problem, clearance, trajectory, settings.clearance)
        times = np.concatenate([times, more])
        feasible = _made_feasible(problem, clearance, trajectory)
        if feasible is None:
            box /= 3.0
            continue
        gain = best.offer(feasible)
        x = feasible.coefficients / scale
        box = min(2.0 * box, _BOX)
        if gain < _SETTLED:
            if sharpness == _SHARPNESS[-1]:
                break
            sharpness = _SHARPNESS[-1]
    best.tell(1.0)


def _watched(
    problem: DesignProblem, clearance: ClearanceModel | None, rng: np.random.Generator
) -> ClearanceModel | None:
    """Leave out the pairs of bodies that stay apart in all of many poses."""
    if clearance is None:
        return None
    lower, upper = position_range(problem.limits)
    poses = rng.uniform(lower, upper, (_POSES, len(lower)))
    return clearance.watched(poses, problem.settings.clearance + _WATCHED)


def _faulty_times(
    problem: DesignProblem,
    clearance: ClearanceModel | None,
    trajectory: FourierTrajectory,
    margin: float,
) -> FloatArray:
    """Return the times at which torque or clearance is worst between the samples of the solver."""
    motion = trajectory.one_period(_CHECK * trajectory.harmonics)
    limits = problem.limits
    excess = (np.abs(problem.arm.joint_torque(motion)) / limits.torque).max(axis=1) - 1.0
    if clearance is not None:
        near = clearance.near(motion.q, margin)
        lack = np.zeros(len(motion))
        np.maximum.at(lack, near.sample, margin - near.distance)
        excess = np.maximum(excess, lack)
    peak = (excess >= np.roll(excess, 1)) & (excess > np.roll(excess, -1)) & (excess > 0.0)
    return np.asarray(motion.t[peak])


def _made_feasible(
    problem: DesignProblem, clearance: ClearanceModel | None, trajectory: FourierTrajectory
) -> FourierTrajectory | None:
    """Make a trajectory a little smaller until nothing is wrong with it, if that is enough."""
    for _ in range(_SHRINKS):
        faults = trajectory_faults(
            problem.arm, problem.limits, trajectory, clearance, problem.settings.clearance
        )
        if not faults:
            return trajectory
        trajectory = _smaller(trajectory, faults)
    return None


def _smaller(trajectory: FourierTrajectory, faults: Faults) -> FourierTrajectory:
    """Shrink the joints at fault, all of them where it is not clear which."""
    own = {v.joint for v in faults.violations if v.limit != 'torque'}
    everywhere = len(own) < len(faults.violations) + len(faults.approaches)
    factor = [_SHRINK if everywhere or j in own else 1.0 for j in trajectory.joints]
    return trajectory.scaled(np.array(factor))


def _solve(
    objective: Objective,
    constraints: Constraints,
    scale: FloatArray,
    x: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    iterations: int,
    step: Callable[[int], None],
) -> tuple[FloatArray, int]:
    """
    Run SLSQP.

    Parameters
    ----------
    objective, constraints : Objective, Constraints
        What to make small, and what to keep.
    scale, x : ndarray, shape (n, 1 + 2 H)
        Unit of every coefficient, and where to begin in these units.
    bounds : tuple of ndarray
        Least and largest values, in these units.
    iterations : int
        How many at most.
    step : callable
        Told the number of iterations after each.

    Returns
    -------
    z : ndarray, shape (n, 1 + 2 H)
        Where it ended, in these units.
    count : int
        Iterations it took, one at least.

    """
    count = 0
    cost = _Last(lambda z: objective.value(z.reshape(scale.shape) * scale))
    limits = _Last(lambda z: constraints.value(z.reshape(scale.shape) * scale))

    def counted(z: FloatArray) -> None:
        nonlocal count
        count += 1
        step(count)

    result = scipy.optimize.minimize(
        lambda z: cost(z)[0] if np.isfinite(cost(z)[0]) else _NO_COST,
        x.ravel(),
        jac=lambda z: (cost(z)[1]() * scale).ravel(),
        method='SLSQP',
        bounds=scipy.optimize.Bounds(bounds[0].ravel(), bounds[1].ravel()),
        constraints=[
            {
                'type': 'ineq',
                'fun': lambda z: -limits(z)[0],
                'jac': lambda z: -(limits(z)[1]() * scale).reshape(-1, scale.size),
            }
        ],
        options={'maxiter': iterations, 'ftol': 1e-5},
        callback=counted,
    )
    return np.asarray(result.x).reshape(scale.shape), max(count, 1)


def _coefficient_scale(limits: Limits, period: float, harmonics: int) -> FloatArray:
    """Size of every coefficient that alone reaches a limit, shape (n, 1 + 2 H)."""
    lower, upper = position_range(limits)
    half = 0.5 * (upper - lower)[:, np.newaxis]
    k = 2.0 * np.pi / period * np.arange(1, harmonics + 1)
    largest = np.minimum(limits.velocity[:, np.newaxis], limits.acceleration[:, np.newaxis] / k)
    amplitude = np.minimum(half * k, largest) / np.sqrt(harmonics)
    return np.column_stack([half, amplitude, amplitude])


def _coefficient_range(limits: Limits, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Bound the scaled coefficients by what no feasible trajectory can exceed.

    The amplitude of a harmonic is at most 4 / pi times the largest value of the curve.

    """
    harmonics = (scale.shape[1] - 1) // 2
    upper = np.full_like(scale, 4.0 / np.pi * np.sqrt(harmonics))
    lower = -upper
    low, high = position_range(limits)
    lower[:, 0], upper[:, 0] = low / scale[:, 0], high / scale[:, 0]
    return lower, upper


class _Last(Generic[_Result]):
    """A function that remembers the last point and what came out there."""

    def __init__(self, function: Callable[[FloatArray], _Result]) -> None:
        self._function = function
        self._known: tuple[bytes, _Result] | None = None

    def __call__(self, z: FloatArray) -> _Result:
        if self._known is None or self._known[0] != z.tobytes():
            self._known = z.tobytes(), self._function(z)
        return self._known[1]
