# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What to design, and how hard to try."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.schedule import MAX_DURATION
from armid_ros.excitation.search.criteria import CRITERIA
from armid_ros.motion import FloatArray
import numpy as np

#: Which parameters a design is for.
TARGETS = {
    'all': 'all base parameters of the rigid body, and those of the effects',
    'gravity': 'masses and first moments as an arm moving slowly shows them, and the effects',
    'effects': 'those of the effects alone, the rigid body being known',
}

#: Samples of one period at which a search looks: at least, and per harmonic.
_SAMPLES, _PER_HARMONIC = 64, 12


@dataclass(frozen=True)
class DesignSettings:
    """
    What to design.

    Attributes
    ----------
    period : float
        Period of the trajectory [s].
    harmonics : int
        Number of harmonics per joint.
    n_periods : int
        How often the period is run through.
    run_in : float
        Shortest duration of the run-in and of the run-out [s]; they are made longer where the
        limits need it.
    speed : str or float
        'slow', 'medium', 'fast' or a share of the velocity and acceleration limits.
    acceleration : ndarray, shape (n,), or None
        What the drives can do [rad/s^2 or m/s^2], which no URDF says; None: the top speed in
        0.25 s. ``speed`` applies to it.
    clearance : float
        Distance to keep between bodies that may touch [m].
    criterion : str
        'D', 'A', 'E', 'condition', or 'T' to tell the arm from a rival.
    balance : float
        Criterion 'D' minimises -log det / r + balance * log(condition number), r parameters: of
        trajectories that tell about equally much it takes the one without a blind direction. 0:
        D-optimality and nothing else.
    target : str
        'all', 'gravity' or 'effects'.
    focus : tuple of str
        Names of effects: see these as well as possible, the other parameters being fitted too.
        Empty: see all alike. Not with criterion 'T'.
    noise : ndarray, shape (n,), or None
        Standard deviation of the torque noise of each joint [N m or N]; None: 1 % of the torque
        limit, or of the largest such limit where a joint has none.
    rate : float
        Samples per second that the noise refers to [Hz], for the predicted deviations.
    candidates : int
        Number of random feasible trajectories to begin with; of an arm of more than 10 joints,
        fewer in proportion.
    starts : int
        Number of them, the best ones, that are improved; of these the better half goes on after
        every second round.
    iterations : int
        Iterations of each of them. This, not the time, decides between results.
    time_budget : float
        Processor time [s]; infinite by default. A search that uses more is stopped once it has
        found something; the same seed then need not give the same trajectory, and the design
        says so.

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
        """Check names and numbers."""
        for kind, name, known in (
            ('criterion', self.criterion, CRITERIA),
            ('target', self.target, TARGETS),
        ):
            if name not in known:
                raise TrajectoryError(f"no {kind} '{name}'; there are {', '.join(known)}")
        if self.focus and self.criterion == 'T':
            raise TrajectoryError("focus goes with every criterion but 'T', which has a rival")
        self._require_numbers()

    def _require_numbers(self) -> None:
        """Refuse counts below one, times that are not positive, and negative sizes."""
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
        """Samples of one period at which a search looks."""
        return max(_SAMPLES, _PER_HARMONIC * self.harmonics)


def whole_period(duration: float, n_periods: int, run_in: float, rate: float) -> float:
    """
    Return the period that fills a run, a whole number of samples long [s].

    Parameters
    ----------
    duration : float
        From rest to rest [s]; the run may become half a sample a period longer or shorter.
    n_periods : int
        How often the period is run through.
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
