# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How to get into a trajectory and out of it again: where to enter, and how slowly."""

from __future__ import annotations

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.feasibility import excitation_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.problem import DesignProblem
from armid_ros.excitation.schedule import Excitation
import numpy as np

#: Points of the period at which it may be entered.
_ENTRIES = 48

#: Factor by which the run-in is made longer, and how often.
_LONGER, _TRIES = 1.5, 12


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
