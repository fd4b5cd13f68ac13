# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Design of an excitation: the trajectory that shows the parameters best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.feasibility import excitation_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.limits import Limits, used_shares
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.schedule import Excitation
from armid_ros.excitation.search.criteria import Information
from armid_ros.excitation.search.local import Search
from armid_ros.excitation.settings import DesignSettings
from armid_ros.motion import FloatArray
from armid_ros.robots import CollisionModel
import numpy as np

#: Points of the period at which it may be entered.
_ENTRIES = 48

#: Factor by which the run-in is made longer, and how often.
_LONGER, _TRIES = 1.5, 12


@dataclass(frozen=True)
class DesignProgress:
    """
    How far a design has come.

    Attributes
    ----------
    done : float
        Share of the work done, 0 ... 1.
    cost : float
        Cost of the best feasible trajectory so far; see `Criterion`.

    """

    done: float
    cost: float


@dataclass(frozen=True)
class Design:
    """
    An excitation and what it will show.

    Attributes
    ----------
    excitation : Excitation
        The run.
    information : Information
        What the whole run, all periods recorded, tells about the base parameters, what was known
        before included.
    described : ndarray, shape (r,)
        Values of these parameters in the prior model.
    noise : ndarray, shape (n,)
        Torque noise that was reckoned with [N m or N].
    cost : float
        What was made small; see `Criterion`.
    limits : Limits
        The limits it keeps.
    settings : DesignSettings
        What was asked for.
    stopped : str
        '' when the search ran to its end; 'time budget' or 'interrupted' when the best so far
        was taken, which the same seed need not give again.

    """

    excitation: Excitation
    information: Information
    described: FloatArray
    noise: FloatArray
    cost: float
    limits: Limits
    settings: DesignSettings
    stopped: str = ''

    def limits_used(self, arm: ArmModel) -> dict[str, FloatArray]:
        """
        Say how much of every limit the excitation uses, which the ways there and back do not keep.

        Parameters
        ----------
        arm : ArmModel
            Prior model, for the torque.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            See `used_shares`.

        """
        motion = self.excitation.motion(self.settings.rate)
        return used_shares(self.limits, motion, arm.joint_torque(motion))


def design(
    arm: ArmModel,
    settings: DesignSettings,
    rng: np.random.Generator,
    *,
    collision: CollisionModel | None = None,
    prior_information: FloatArray | None = None,
    rival: ArmModel | None = None,
    progress: Callable[[DesignProgress], None] | None = None,
) -> Design:
    """
    Find the trajectory that shows the parameters best.

    Parameters
    ----------
    arm : ArmModel
        Prior model: the robot, and the effects whose parameters are wanted.
    settings : DesignSettings
        What to design.
    rng : Generator
        Source of randomness; the same state gives the same trajectory.
    collision : CollisionModel, optional
        Bodies to keep apart by ``settings.clearance``, such as ``collision_model(arm.robot)``, or
        ``with_obstacles`` of it.
    prior_information : ndarray, shape (r, r), optional
        Information of what was recorded before, over the same base parameters: the sum of
        ``DesignProblem.information(motion).matrix`` of the recordings.
    rival : ArmModel, optional
        With criterion 'T': the model to tell ``arm`` from.
    progress : callable, optional
        Receives the progress after every step.

    Returns
    -------
    Design
        The best found. KeyboardInterrupt ends the search and the best so far is returned.

    Raises
    ------
    TrajectoryError
        If nothing is feasible; says which limit of which joint, or which bodies, stand in the
        way.

    """
    problem = DesignProblem.of(arm, settings, rng, rival)
    clearance = None if collision is None else ClearanceModel.of(collision)
    prior = _checked_prior(problem, prior_information, rival)

    def watch(done: float, cost: float) -> None:
        if progress is not None:
            progress(DesignProgress(done, cost))

    search = Search(problem, clearance, prior, rng.spawn(1)[0], watch)
    stopped = search.run()
    assert search.trajectory is not None
    excitation = placed(problem, search.trajectory)
    return evaluate(problem, excitation, prior, stopped=stopped)


def placed(problem: DesignProblem, trajectory: FourierTrajectory) -> Excitation:
    """
    Make a run of a trajectory that is within all limits from rest to rest.

    The trajectory is entered where that takes least of the limits, and the run-in made longer
    until nothing is wrong.

    Raises
    ------
    TrajectoryError
        If there is no way in; names the limit in the way.

    """
    settings, limits = problem.settings, problem.limits

    def effort(run: Excitation) -> float:
        """Return the largest share of a velocity or acceleration limit on the way in."""
        way = run.at(np.linspace(0.0, run.run_in, 40))
        velocity = np.abs(way.dq) / limits.velocity
        acceleration = np.abs(way.ddq) / limits.acceleration
        return float(max(velocity.max(), acceleration.max()))

    run_in = settings.run_in
    last = ''
    for _ in range(_TRIES):
        runs = [
            Excitation(
                trajectory.shifted(k * trajectory.period / _ENTRIES),
                settings.n_periods,
                run_in,
            )
            for k in range(_ENTRIES)
        ]
        for run in sorted(runs, key=effort)[:6]:
            faults = excitation_faults(problem.arm, limits, run)
            if not faults:
                return run
            last = f'in {run_in:.3g} s, {faults}'
        run_in *= _LONGER
    raise TrajectoryError(f'no way into the trajectory and out of it; {last}')


def evaluate(
    problem: DesignProblem,
    excitation: Excitation | FourierTrajectory,
    prior_information: FloatArray | None = None,
    *,
    stopped: str = '',
) -> Design:
    """
    Say what a run, or a trajectory with the settings of a problem, is worth.

    Parameters
    ----------
    problem : DesignProblem
        What is wanted.
    excitation : Excitation or FourierTrajectory
        What is to be run.
    prior_information : ndarray, shape (r, r), optional
        Information that is there already.
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


def _checked_prior(
    problem: DesignProblem, prior: FloatArray | None, rival: ArmModel | None
) -> FloatArray | None:
    if prior is None:
        return None
    prior = np.asarray(prior, dtype=float)
    expected = (problem.base.rank,) * 2
    if rival is not None or prior.shape != expected:
        raise TrajectoryError(
            f'prior information: a matrix {expected} over the base parameters of the arm is '
            f"needed, and none with criterion 'T'; got {prior.shape}"
        )
    if not np.all(np.isfinite(prior)):
        raise TrajectoryError('prior information: not all entries are finite numbers')
    return prior
