# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Local optimisation of the best random trajectories within all limits.

Several searches start. After every second round, the worse half ends, so the best searches get
most of the computing time. The solver is SLSQP of SciPy, sequential quadratic
programming; docs/excitation.md compares it with others. The solver works on samples. After each
round the result is checked between the samples. The times of faults are added to the samples of
the next round.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
import math
import time

from armid_ros.excitation.feasibility import random_feasible, trajectory_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.limits import Violation
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.search.functions import Constraints, Objective, Part
from armid_ros.motion import FloatArray
import numpy as np
import scipy.optimize

#: Reasons for the early end of a search.
INTERRUPTED, OUT_OF_TIME = 'interrupted', 'time budget'

#: Sharpness of the soft maximum: low while the cost improves, then high.
_SHARPNESS = (60.0, 300.0)

#: Iterations of a round.
_ROUND_ITERATIONS = 25

#: Rounds after which the worse half of the searches ends.
_ROUNDS_PER_HALVING = 2

#: Half width of the box of a round, in units of the coefficients' scale.
_BOX_HALF_WIDTH = 0.5


class _OutOfTime(Exception):
    """Exception that ends a search whose time budget is used up."""


class Search:
    """
    Search for the trajectory with the least cost; an early stop keeps the best trajectory.

    Parameters
    ----------
    problem : DesignProblem
        The design problem.
    clearance : ClearanceModel or None
        Bodies to keep apart.
    prior : ndarray, shape (r, r), or None
        Information of earlier recordings.
    rng : Generator
        Source of randomness.
    watch : callable
        Called with the share of the work done, and the cost of the best trajectory so far.

    Attributes
    ----------
    trajectory : FourierTrajectory or None
        Best trajectory so far; feasible at and between all samples.
    cost : float
        Cost of the best trajectory.

    """

    def __init__(
        self,
        problem: DesignProblem,
        clearance: ClearanceModel | None,
        prior: FloatArray | None,
        rng: np.random.Generator,
        watch: Callable[[float, float], None],
    ) -> None:
        self.problem, self.clearance, self.prior, self.rng = problem, clearance, prior, rng
        self.trajectory: FourierTrajectory | None = None
        self.cost = np.inf
        self._watch, self._begun, self._steps = watch, time.process_time(), 0
        settings = problem.settings
        # arms of more than ten joints get fewer candidates
        share = min(1.0, 10 / problem.arm.robot.n_joints)
        self._candidates = max(math.ceil(share * settings.candidates), settings.starts)
        others = 2 * _ROUNDS_PER_HALVING * _ROUND_ITERATIONS * (settings.starts - 1)
        self._work = self._candidates + settings.iterations + others

    def run(self) -> str:
        """
        Run the search; return '', or the reason of an early end: 'time budget', 'interrupted'.

        Raises
        ------
        TrajectoryError
            If no trajectory is feasible.
        KeyboardInterrupt
            If interrupted before a feasible trajectory was found.

        """
        try:
            # start values: the best candidates
            problem, settings = self.problem, self.problem.settings
            drawn: list[tuple[float, FourierTrajectory]] = []
            for _ in range(self._candidates):
                trajectory = random_feasible(
                    problem.arm,
                    problem.limits,
                    settings.period,
                    settings.harmonics,
                    self.rng,
                    clearance=self.clearance,
                )
                drawn.append((self.keep_best(trajectory), trajectory))
            drawn.sort(key=lambda pair: pair[0])
            self._improve([trajectory for _, trajectory in drawn[: settings.starts]])
        except _OutOfTime:
            return OUT_OF_TIME
        except KeyboardInterrupt:
            if self.trajectory is None:
                raise
            return INTERRUPTED
        self._watch(1.0, self.cost)
        return ''

    def keep_best(self, trajectory: FourierTrajectory) -> float:
        """Return the cost of a feasible trajectory; store the trajectory if it is the best."""
        problem, prior = self.problem, self.prior
        matrix = problem.recorded(trajectory, problem.settings.n_periods).matrix
        cost = problem.criterion.cost(matrix if prior is None else matrix + prior)
        if cost < self.cost or self.trajectory is None:
            self.trajectory, self.cost = trajectory, cost
        self.step()
        return cost

    def step(self) -> None:
        """Count a step of the search, report progress, and stop the search at the time budget."""
        self._steps += 1
        self._watch(min(self._steps / self._work, 1.0), self.cost)
        if time.process_time() - self._begun > self.problem.settings.time_budget:
            raise _OutOfTime

    def _improve(self, starts: list[FourierTrajectory]) -> None:
        """Optimise trajectories in rounds; drop the worse half after every second round."""
        objective, nearby = Objective(self.problem, self.prior), self.clearance
        if nearby is not None:  # ignore pairs of bodies that are far apart in many poses
            limits = self.problem.limits
            lower, upper = limits.position_range()
            # The solver ignores pairs of bodies that stay 1 cm beyond the margin in 1000 random
            # poses, and adds 1 mm to it. The proof of clearance checks all pairs.
            poses = self.rng.uniform(lower, upper, (1000, len(lower)))
            nearby = nearby.without_distant_pairs(poses, nearby.margin + 0.01)
            nearby = replace(nearby, margin=nearby.margin + 0.001)
        branches = [_Branch(self, objective, nearby, start) for start in starts]
        while branches:
            for branch in branches:
                for _ in range(_ROUNDS_PER_HALVING):
                    branch.advance()
            branches = sorted(branches, key=lambda branch: branch.cost)[: -(-len(branches) // 2)]
            branches = [branch for branch in branches if branch.remaining > 0]


@dataclass
class _Branch:
    """Local search from one start: last feasible trajectory, and settings of the next round."""

    search: Search
    objective: Objective
    nearby: ClearanceModel | None
    trajectory: FourierTrajectory
    cost: float = np.inf

    def __post_init__(self) -> None:
        """Set the scales of Fourier coefficients, and the bounds of the scaled coefficients."""
        limits, settings = self.search.problem.limits, self.search.problem.settings
        low, high = limits.position_range()
        half = 0.5 * (high - low)[:, np.newaxis]
        k = 2.0 * np.pi / settings.period * np.arange(1, settings.harmonics + 1)
        rates = np.minimum(limits.velocity[:, np.newaxis], limits.acceleration[:, np.newaxis] / k)
        amplitude = np.minimum(half * k, rates) / np.sqrt(settings.harmonics)
        self.scale = np.column_stack([half, amplitude, amplitude])
        # the amplitude of a harmonic is at most 4 / pi times the largest value of the curve
        self.upper = np.full_like(self.scale, 4.0 / np.pi * np.sqrt(settings.harmonics))
        self.lower = -self.upper
        self.lower[:, 0], self.upper[:, 0] = low / self.scale[:, 0], high / self.scale[:, 0]
        self.remaining = settings.iterations
        self.times, self.box, self.sharpness = np.empty(0), _BOX_HALF_WIDTH, _SHARPNESS[0]

    def advance(self) -> None:
        """Run the solver for one round, within a box around the last feasible coefficients."""
        if self.remaining <= 0:
            return
        problem, clearance = self.search.problem, self.search.clearance
        settings = problem.settings
        # the solver keeps a reserve of 0.2 % to every limit
        constraints = Constraints(
            problem,
            self.nearby,
            reserve=0.002,
            sharpness=self.sharpness,
            more_times=self.times,
        )
        z, used = self._solve(constraints, min(_ROUND_ITERATIONS, self.remaining))
        self.remaining -= used
        trajectory = FourierTrajectory.of(problem.limits.joints, settings.period, z * self.scale)
        # the times of the worst torque or clearance faults between the samples
        motion = trajectory.one_period(200 * trajectory.harmonics)
        torque = np.abs(problem.arm.joint_torque(motion))
        excess = (torque / problem.limits.torque).max(axis=1) - 1.0
        if clearance is not None:
            apart = clearance.smallest(motion.q, reach=clearance.margin)
            excess = np.maximum(excess, clearance.margin - apart)
        peak = (excess >= np.roll(excess, 1)) & (excess > np.roll(excess, -1)) & (excess > 0.0)
        self.times = np.concatenate([self.times, motion.t[peak]])
        feasible = _made_feasible(problem, clearance, trajectory)
        if feasible is None:
            self.box /= 3.0
            return
        cost = self.search.keep_best(feasible)
        gain, self.cost = self.cost - cost, min(cost, self.cost)
        self.trajectory, self.box = feasible, min(2.0 * self.box, _BOX_HALF_WIDTH)
        # gain of a round below which the search has converged
        if gain < 0.005:
            self.remaining = 0 if self.sharpness == _SHARPNESS[-1] else self.remaining
            self.sharpness = _SHARPNESS[-1]

    def _solve(self, constraints: Constraints, iterations: int) -> tuple[FloatArray, int]:
        """Run SLSQP; return the scaled coefficients, (n, 1 + 2 H), and the number of steps."""
        count, scale = 0, self.scale
        x = self.trajectory.coefficients / scale

        @lru_cache(maxsize=1)
        def cost(z: bytes) -> tuple[float, Callable[[], FloatArray]]:
            return self.objective.value(np.frombuffer(z).reshape(scale.shape) * scale)

        @lru_cache(maxsize=1)
        def limits(z: bytes) -> Part:
            return constraints.value(np.frombuffer(z).reshape(scale.shape) * scale)

        def finite_cost(z: FloatArray) -> float:
            value = cost(z.tobytes())[0]
            return value if np.isfinite(value) else 1e3  # a line search needs a finite cost

        def counted(z: FloatArray) -> None:
            nonlocal count
            count += 1
            self.search.step()

        result = scipy.optimize.minimize(
            finite_cost,
            x.ravel(),
            jac=lambda z: (cost(z.tobytes())[1]() * scale).ravel(),
            method='SLSQP',
            bounds=scipy.optimize.Bounds(
                np.maximum(self.lower, x - self.box).ravel(),
                np.minimum(self.upper, x + self.box).ravel(),
            ),
            constraints=[
                {
                    'type': 'ineq',
                    'fun': lambda z: -limits(z.tobytes())[0],
                    'jac': lambda z: -(limits(z.tobytes())[1]() * scale).reshape(-1, scale.size),
                }
            ],
            options={'maxiter': iterations, 'ftol': 1e-5},
            callback=counted,
        )
        return np.asarray(result.x).reshape(scale.shape), max(count, 1)


def _made_feasible(
    problem: DesignProblem, clearance: ClearanceModel | None, trajectory: FourierTrajectory
) -> FourierTrajectory | None:
    """Reduce amplitudes of a trajectory until it is feasible; return None if this fails."""
    # a joint beyond its own limits is reduced alone; torque and clearance reduce all joints
    for _ in range(12):
        faults = trajectory_faults(problem.arm, problem.limits, trajectory, clearance)
        if not faults:
            return trajectory
        exceeding = {v.joint for v in faults if isinstance(v, Violation) and v.limit != 'torque'}
        everywhere = len(exceeding) < len(faults)
        factor = [0.99 if everywhere or j in exceeding else 1.0 for j in trajectory.joints]
        trajectory = trajectory.scaled(np.array(factor))
    return None
