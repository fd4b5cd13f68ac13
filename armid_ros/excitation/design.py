# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Search for the excitation that carries the most information on the parameters of an arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.feasibility import excitation_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.problem import DesignProblem, DesignSettings
from armid_ros.excitation.schedule import Excitation
from armid_ros.excitation.search.criteria import Information
from armid_ros.excitation.search.local import Search
from armid_ros.motion import FloatArray
from armid_ros.robots import CollisionModel
import numpy as np

#: Callback with the share of the work done, 0 ... 1, and the cost of the best trajectory so far.
Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Design:
    """
    Designed excitation, and the Fisher information that its recording would contain.

    Attributes
    ----------
    excitation : Excitation
        The designed run.
    information : Information
        Information of the whole run on the base parameters, with all periods recorded; prior
        information included.
    described : ndarray, shape (r,)
        Values of the base parameters in the prior model.
    noise : ndarray, shape (n,)
        Assumed standard deviation of the torque noise [N m or N].
    cost : float
        Cost of the design; see `Criterion`.
    limits : Limits
        The limits that the excitation keeps.
    settings : DesignSettings
        Settings of the design.
    stopped : str
        '' if the search ran to its end; 'time budget' or 'interrupted' if the best trajectory so
        far was taken. The same seed may then give another trajectory.

    """

    excitation: Excitation
    information: Information
    described: FloatArray
    noise: FloatArray
    cost: float
    limits: Limits
    settings: DesignSettings
    stopped: str = ''

    def robot_limits_used(self, arm: ArmModel) -> dict[str, FloatArray]:
        """Return the peak of the excitation as a share of each robot limit, by quantity."""
        full = Limits.of(arm.robot, speed=1.0, reserve=False)
        return replace(self, limits=full).limits_used(arm)

    def limits_used(self, arm: ArmModel) -> dict[str, FloatArray]:
        """
        Return the peak of the excitation as a share of each limit of the design, by quantity.

        Transfers to and from the excitation do not count.

        Parameters
        ----------
        arm : ArmModel
            Prior model, for the torque.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            'position': largest distance from the middle of the range over half of it; 'velocity',
            'acceleration' and 'torque': largest absolute value over the limit. 0 without a limit.

        """
        limits, motion = self.limits, self.excitation.motion(self.settings.rate)
        half = 0.5 * (limits.upper - limits.lower)
        middle = np.subtract(limits.upper, half, out=np.zeros_like(half), where=np.isfinite(half))
        used = {
            'position': (motion.q - middle, half),
            'velocity': (motion.dq, limits.velocity),
            'acceleration': (motion.ddq, limits.acceleration),
            'torque': (arm.joint_torque(motion), limits.torque),
        }
        return {name: np.abs(x).max(axis=0) / bound for name, (x, bound) in used.items()}


def design(
    arm: ArmModel,
    settings: DesignSettings,
    rng: np.random.Generator,
    *,
    collision: CollisionModel | None = None,
    prior_information: FloatArray | None = None,
    rival: ArmModel | None = None,
    progress: Progress = lambda done, cost: None,
) -> Design:
    """
    Find the feasible excitation with the most information on the parameters of an arm.

    Parameters
    ----------
    arm : ArmModel
        Prior model: the robot, and the effects whose parameters are to be identified.
    settings : DesignSettings
        Settings of the design.
    rng : Generator
        Source of randomness; equal states give equal trajectories.
    collision : CollisionModel, optional
        Bodies to keep apart by ``settings.clearance``, such as ``collision_model(arm.robot)``, or
        ``with_obstacles`` of it.
    prior_information : ndarray, shape (r, r), optional
        Information of earlier recordings on the same base parameters: the sum of
        ``DesignProblem.information(motion).matrix`` of the recordings.
    rival : ArmModel, optional
        The model to distinguish ``arm`` from, with criterion 'T'.
    progress : callable
        Called after every step with the share of the work done, and with the cost of the best
        feasible trajectory so far.

    Returns
    -------
    Design
        The best design found. A KeyboardInterrupt ends the search, and the best design so far is
        returned.

    Raises
    ------
    TrajectoryError
        If no trajectory is feasible; the message names the joint and its limit, or the bodies.

    """
    problem = DesignProblem.of(arm, settings, rng, rival)
    clearance = None
    if collision is not None:
        clearance = ClearanceModel.of(collision, settings.clearance)
    prior = None if prior_information is None else np.asarray(prior_information, dtype=float)
    if prior is not None:
        expected = (problem.base.rank,) * 2
        if rival is not None:
            raise TrajectoryError("the criterion 'T' does not use prior information; omit it")
        if prior.shape != expected or not np.all(np.isfinite(prior)):
            raise TrajectoryError(
                f'prior information of shape {prior.shape}: it has to be a matrix of finite '
                f'numbers of shape {expected}, with a row for each base parameter'
            )

    search = Search(problem, clearance, prior, rng.spawn(1)[0], progress)
    stopped = search.run()
    assert search.trajectory is not None
    excitation = with_run_in(problem, search.trajectory)
    return evaluate(problem, excitation, prior, stopped=stopped)


def with_run_in(problem: DesignProblem, trajectory: FourierTrajectory) -> Excitation:
    """
    Return an excitation that runs a trajectory from rest to rest within all limits.

    The run enters the trajectory at the point with the smallest use of limits in the run-in. The
    run-in is extended until it keeps all limits.

    Raises
    ------
    TrajectoryError
        If no run-in keeps the limits; the message names the limit.

    """
    settings, limits = problem.settings, problem.limits

    def effort(run: Excitation) -> float:
        """Return the largest ratio of velocity or acceleration to its limit in the run-in."""
        path = run.at(np.linspace(0.0, run.run_in, 40))
        velocity = np.abs(path.dq) / limits.velocity
        acceleration = np.abs(path.ddq) / limits.acceleration
        return float(max(velocity.max(), acceleration.max()))

    run_in, reason = settings.run_in, ''
    entries = 48  # points of the period at which a run can enter the trajectory
    for _ in range(12):  # run-ins of increasing duration
        runs = [
            Excitation(
                trajectory.shifted(k * trajectory.period / entries),
                settings.n_periods,
                run_in,
            )
            for k in range(entries)
        ]
        for run in sorted(runs, key=effort)[:6]:
            faults = excitation_faults(problem.arm, limits, run)
            if not faults:
                return run
            reason = f'in {run_in:.3g} s, {faults}'
        run_in *= 1.5
    raise TrajectoryError(f'no run-in from rest is within limits: {reason}; try another --seed')


def evaluate(
    problem: DesignProblem,
    excitation: Excitation | FourierTrajectory,
    prior_information: FloatArray | None = None,
    *,
    stopped: str = '',
) -> Design:
    """
    Return the `Design` of a given excitation or trajectory, with its information and cost.

    Parameters
    ----------
    problem : DesignProblem
        The design problem.
    excitation : Excitation or FourierTrajectory
        The run or trajectory.
    prior_information : ndarray, shape (r, r), optional
        Information of earlier recordings.
    stopped : str
        See `Design`.

    """
    settings = problem.settings
    if isinstance(excitation, FourierTrajectory):
        excitation = Excitation(excitation, settings.n_periods, settings.run_in)
    information = problem.recorded(excitation.trajectory, excitation.n_periods)
    as_wanted = settings.n_periods / excitation.n_periods * information.matrix
    if prior_information is not None:
        information = replace(information, matrix=information.matrix + prior_information)
        as_wanted = as_wanted + prior_information
    cost = problem.criterion.cost(as_wanted)
    described = problem.base.values(problem.arm.theta)
    return Design(
        excitation, information, described, problem.noise, cost, problem.limits, settings, stopped
    )
