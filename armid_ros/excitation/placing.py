# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How to get into a trajectory and out of it again: where to enter, and how slowly."""

from __future__ import annotations

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.feasibility import excitation_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.limits import check_limits
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.schedule import Excitation
from armid_ros.motion import Motion
import numpy as np

#: Points of the period at which it may be entered.
_ENTRIES = 48

#: Factor by which the run-in is made longer, and how often.
_LONGER, _TRIES = 1.5, 12


def placed(
    problem: DesignProblem, trajectory: FourierTrajectory, clearance: ClearanceModel | None
) -> Excitation:
    """
    Make a run of a trajectory that is within all limits from rest to rest.

    The trajectory is entered where that takes least of the limits, and the run-in made longer
    until nothing is wrong.

    Raises
    ------
    TrajectoryError
        If there is no way in; names the limit, or the bodies, in the way.

    """
    settings, limits = problem.settings, problem.limits
    _require_start(problem, clearance)
    run_in = settings.run_in
    last = ''
    for _ in range(_TRIES):
        runs = [
            Excitation(
                trajectory.shifted(k * trajectory.period / _ENTRIES),
                settings.n_periods,
                run_in,
                settings.start,
            )
            for k in range(_ENTRIES)
        ]
        for run in sorted(runs, key=lambda run: _effort(problem, run))[:6]:
            faults = excitation_faults(problem.arm, limits, run, clearance, settings.clearance)
            if not faults:
                return run
            last = f'in {run_in:.3g} s, {faults}'
        run_in *= _LONGER
    raise TrajectoryError(f'no way into the trajectory and out of it; {last}')


def _effort(problem: DesignProblem, run: Excitation) -> float:
    """Largest share of a velocity or acceleration limit on the way in."""
    way = run.at(np.linspace(0.0, run.run_in, 40))
    velocity = np.abs(way.dq) / problem.limits.velocity
    acceleration = np.abs(way.ddq) / problem.limits.acceleration
    return float(max(velocity.max(), acceleration.max()))


def _require_start(problem: DesignProblem, clearance: ClearanceModel | None) -> None:
    """Raise a TrajectoryError where the start pose itself is not allowed."""
    start = problem.settings.start
    if start is None:
        return
    limits = problem.limits
    if start.shape != (len(limits.joints),):
        raise TrajectoryError(
            f'start pose: {len(limits.joints)} positions are needed, for '
            f'{", ".join(limits.joints)}; got {len(start)}'
        )
    rest = np.zeros((1, len(start)))
    motion = Motion(limits.joints, np.zeros(1), start[np.newaxis], rest, rest)
    violations = check_limits(limits, motion, problem.arm.joint_torque(motion))
    if violations:
        raise TrajectoryError('start pose: ' + '; '.join(map(str, violations)))
    nearest = None if clearance is None else clearance.closest(motion)
    if nearest is not None and nearest.distance < problem.settings.clearance:
        raise TrajectoryError(
            f'start pose: {nearest.first} and {nearest.second} are {nearest.distance:.4f} m '
            f'apart, less than the clearance of {problem.settings.clearance:g} m'
        )
