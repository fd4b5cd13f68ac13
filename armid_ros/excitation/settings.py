# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Settings of a design."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.schedule import MAX_DURATION
from armid_ros.excitation.search.criteria import CRITERIA
from armid_ros.motion import FloatArray
import numpy as np

#: Parameter sets that a design can target.
TARGETS = {
    'all': 'all base parameters of the rigid body, and those of the effects',
    'gravity': 'masses and first moments as an arm moving slowly shows them, and the effects',
    'effects': 'those of the effects alone, the rigid body being known',
}


@dataclass(frozen=True)
class DesignSettings:
    """
    Settings of a design: trajectory, limits, criterion and effort of the search.

    Attributes
    ----------
    period : float
        Period of the trajectory [s].
    harmonics : int
        Number of harmonics per joint.
    n_periods : int
        Number of periods.
    run_in : float
        Shortest duration of the run-in and of the run-out [s]; they are made longer if the limits
        require it.
    speed : str or float
        'slow', 'medium', 'fast' or a share of the velocity and acceleration limits.
    acceleration : ndarray, shape (n,), or None
        Acceleration limits of the drives [rad/s^2 or m/s^2], which a URDF does not contain. None:
        the top speed is reached in 0.25 s. ``speed`` applies to these limits.
    clearance : float
        Distance to keep between bodies that may touch [m].
    criterion : str
        'D', 'A', 'E', 'condition', or 'T' to distinguish the arm from a rival.
    balance : float
        Criterion 'D' minimises -log det / r + balance * log(condition number), with r parameters.
        Among trajectories of similar information, it prefers one without a poorly identifiable
        direction. 0: D-optimality only.
    target : str
        'all', 'gravity' or 'effects'.
    focus : tuple of str
        Names of effects to identify as precisely as possible, while the other parameters are
        fitted too. Empty: all parameters count. Not with criterion 'T'.
    noise : ndarray, shape (n,), or None
        Standard deviation of the torque noise of each joint [N m or N]; None: 1 % of the torque
        limit, or of the largest such limit where a joint has none.
    rate : float
        Samples per second that the noise refers to [Hz], for the predicted deviations.
    candidates : int
        Number of random feasible trajectories at the start; proportionally fewer for an arm with
        more than 10 joints.
    starts : int
        Number of the best candidates that are improved; after every second round only the better
        half continues.
    iterations : int
        Iterations per start. The result depends on this number, not on the computing time.
    time_budget : float
        Processor time [s]; infinite by default. A search that uses more is stopped as soon as it
        has found a trajectory. The same seed may then give another trajectory; `Design.stopped`
        states this.

    """

    period: float = 20.0
    harmonics: int = 5
    n_periods: int = 2
    run_in: float = 2.0
    speed: str | float = 'fast'
    acceleration: FloatArray | None = None
    clearance: float = 0.01
    criterion: str = 'D'
    balance: float = 1.0
    target: str = 'all'
    focus: tuple[str, ...] = ()
    noise: FloatArray | None = None
    rate: float = 100.0
    starts: int = 4
    candidates: int = 60
    iterations: int = 200
    time_budget: float = np.inf

    def __post_init__(self) -> None:
        """Check the names and numbers."""
        for kind, name, known in (
            ('criterion', self.criterion, CRITERIA),
            ('target', self.target, TARGETS),
        ):
            if name not in known:
                raise TrajectoryError(f"no {kind} '{name}'; there are {', '.join(known)}")
        if self.focus and self.criterion == 'T':
            raise TrajectoryError(
                "focus is possible with every criterion except 'T', which has a rival"
            )
        self._require_numbers()

    def _require_numbers(self) -> None:
        """Raise a TrajectoryError for an impossible count, time or size."""
        for name in (
            'harmonics',
            'n_periods',
            'starts',
            'candidates',
            'iterations',
        ):
            if getattr(self, name) < 1:
                raise TrajectoryError(f'{name}: {getattr(self, name)}; at least 1 is needed')
        for name in ('period', 'run_in', 'rate'):
            if not 0.0 < getattr(self, name) < np.inf:
                raise TrajectoryError(f'{name}: {getattr(self, name)}; it has to be positive')
        for name in ('time_budget', 'clearance', 'balance'):
            if not getattr(self, name) >= 0.0:
                raise TrajectoryError(f'{name}: {getattr(self, name)}; it cannot be negative')
        duration = self.n_periods * self.period + 2.0 * self.run_in
        if not duration <= MAX_DURATION:
            raise TrajectoryError(
                f'{self.n_periods} periods of {self.period:g} s and run-ins of {self.run_in:g} s '
                f'last {duration:.3g} s; a day is the most'
            )

    @property
    def samples(self) -> int:
        """Number of samples of one period in a search."""
        return max(64, 12 * self.harmonics)


def whole_period(duration: float, n_periods: int, run_in: float, rate: float) -> float:
    """
    Return the period of a run of given duration, a whole number of samples long [s].

    Parameters
    ----------
    duration : float
        Duration from rest to rest [s]; the run may become longer or shorter by half a sample per
        period.
    n_periods : int
        Number of periods.
    run_in : float
        Duration of the run-in, and of the run-out [s].
    rate : float
        Samples per second [Hz].

    Raises
    ------
    TrajectoryError
        If less than a second is left for a period.

    """
    period = (duration - 2.0 * run_in) / n_periods
    if not 1.0 <= period < np.inf:
        raise TrajectoryError(
            f'duration {duration:g} s leaves {period:.3g} s for each of {n_periods} '
            'periods; give it more time, or fewer periods'
        )
    return round(period * rate) / rate
