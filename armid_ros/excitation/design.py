# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Design of an excitation: the trajectory that shows the parameters best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.excitation.criteria import Information
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.limits import require_within
from armid_ros.excitation.problem import DesignSettings, Problem
from armid_ros.excitation.random import random_feasible
from armid_ros.excitation.schedule import Excitation
from armid_ros.motion import FloatArray
from armid_ros.robots import CollisionModel
import numpy as np


@dataclass(frozen=True)
class Progress:
    """
    How far a design has come.

    Attributes
    ----------
    done : float
        Share of the work done, 0 ... 1.
    cost : float
        Cost of the best feasible trajectory so far; see `Information.cost`.

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
        What the whole run, all periods recorded, tells about the parameters, prior included.
    cost : float
        What was made small; see `Information.cost`.
    settings : DesignSettings
        What was asked for.

    """

    excitation: Excitation
    information: Information
    cost: float
    settings: DesignSettings


def design(
    arm: ArmModel,
    settings: DesignSettings,
    rng: np.random.Generator,
    *,
    collision: CollisionModel | None = None,
    prior_information: FloatArray | None = None,
    progress: Callable[[Progress], None] | None = None,
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
        Bodies to keep apart by ``settings.clearance``, such as ``collision_model(arm.robot)``.
    prior_information : ndarray, shape (r, r), optional
        Information of what was recorded before, over the same base parameters.
    progress : callable, optional
        Told after every step.

    Raises
    ------
    TrajectoryError
        If nothing feasible was found; says which limit of which joint stands in the way.

    """
    problem = Problem.of(arm, settings, rng)
    total = settings.starts * settings.candidates
    best: Design | None = None
    for count in range(1, total + 1):
        trajectory = random_feasible(
            arm,
            problem.limits,
            settings.period,
            settings.harmonics,
            rng,
            collision=collision,
            margin=settings.clearance,
        )
        candidate = evaluate(problem, trajectory, prior_information)
        if best is None or candidate.cost < best.cost:
            best = candidate
        if progress is not None:
            progress(Progress(count / total, best.cost))
    assert best is not None
    run = best.excitation.motion(settings.rate)
    require_within(problem.limits, run, arm.torque(run))
    return best


def evaluate(
    problem: Problem, trajectory: FourierTrajectory, prior_information: FloatArray | None = None
) -> Design:
    """Say what a trajectory is worth."""
    settings = problem.settings
    excitation = Excitation(trajectory, settings.n_periods, settings.run_in, settings.start)
    motion = trajectory.one_period(settings.samples)
    recorded = settings.rate * settings.period * settings.n_periods
    information = problem.information(motion, recorded).plus(prior_information)
    return Design(excitation, information, information.cost(settings.criterion), settings)
