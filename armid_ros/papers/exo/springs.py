# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Online identification of the stiffness and slack of straps between two machines.

A strap with slack pulls with k (|D| - slack) along D if |D| exceeds the slack; otherwise not. The
torque is nonlinear in the slack, so the stiffness is fitted at several slacks, in the search for
the best one. The curvature of the misfit gives the standard deviation of the slack.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from armid_ros.errors import IdentificationError
from armid_ros.identification.ties.problem import Inertias, InteractionProblem
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.model.spring_ties import TiedMachines
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy.optimize import minimize_scalar


@dataclass(frozen=True)
class Slack:
    """
    Common slack of the straps between two machines, and strap stiffness at this slack.

    Attributes
    ----------
    value, std : float
        Slack and its standard deviation [m].
    gain : float
        Decrease of the misfit relative to the fit without slack, in units of its noise.
    interaction : Interaction
        The stiffnesses with this slack.

    """

    value: float
    std: float
    gain: float
    interaction: Interaction

    @property
    def seen(self) -> bool:
        """Whether the fit with slack is significantly better than the fit without slack."""
        # significance limit of the decrease of the misfit, in units of its noise
        return self.gain > 25.0


def find_slack(problem: Callable[[float], InteractionProblem]) -> Slack:
    """
    Fit a common slack of all straps, together with the strap stiffness.

    Parameters
    ----------
    problem : callable
        Callback that returns the stiffness regression for a slack [m].

    """
    fits: dict[float, Interaction] = {}

    def misfit(slack: float) -> float:
        if slack not in fits:
            fits[slack] = identify_interaction(problem(slack))
        return fits[slack].misfit

    # largest plausible slack of a strap, and accuracy of the search [m]
    largest, accuracy = 0.01, 2e-5
    searched = minimize_scalar(
        misfit, bounds=(0.0, largest), method='bounded', options={'xatol': accuracy}
    )
    best, step = float(searched.x), 2e-4  # of the second difference [m]
    lower, middle, upper = (misfit(max(best, step) + k * step) for k in (-1, 0, 1))
    bend = (lower - 2.0 * middle + upper) / step**2
    found = fits[best]
    freedom = max(1, found.residual.size - len(found.estimate.values))
    noise = max(1.0, found.misfit / freedom)
    std = float(np.sqrt(2.0 * noise / bend)) if bend > 0.0 else np.inf
    return Slack(best, std, (misfit(0.0) - found.misfit) / noise, found)


#: Time between two fits of slack, which need several estimates [s].
_SLACK_PERIOD = 30.0
#: Rate of the averaged samples [Hz], far above the frequencies of human motion.
_AVERAGED_RATE = 100.0


def _add(rows: deque[FloatArray], row: FloatArray, memory: float) -> None:
    """Add a sample, time first; keep `memory` seconds, none from before a step back in time."""
    if rows and row[0] <= rows[-1][0]:
        rows.clear()
    rows.append(row)
    while row[0] - rows[0][0] > memory:
        rows.popleft()


def _averaged(rows: deque[FloatArray]) -> FloatArray:
    """Return samples, time first, averaged over each period of `_AVERAGED_RATE`."""
    table = np.array(rows)
    begins = np.flatnonzero(np.diff(np.floor(_AVERAGED_RATE * table[:, 0]), prepend=-np.inf))
    counts = np.diff(begins, append=len(table))[:, np.newaxis]
    return np.asarray(np.add.reduceat(table, begins) / counts)


class OnlineInteraction:
    """
    Online estimator of the stiffness and slack of straps between two machines.

    Parameters
    ----------
    machines : TiedMachines
        Both machines, and the attachment points of the straps.
    memory : float
        Length of the time window of the estimate [s].
    period : float
        Time between two estimates [s].
    inertias : {'known', 'free'}
        Whether the inertias of the machine are taken from its description or estimated.

    Raises
    ------
    IdentificationError
        If the time window is shorter than 3 s or than the period.

    Attributes
    ----------
    together, separate : Interaction or None
        Estimates of one stiffness for all straps, and of one for each strap; None before the first
        estimate.
    slack : Slack or None
        Slack of the straps; None while straps without slack explain the torques.

    """

    def __init__(
        self,
        machines: TiedMachines,
        *,
        memory: float = 10.0,
        period: float = 2.0,
        inertias: Inertias = 'known',
    ) -> None:
        if not (memory >= 3.0 and 0.0 < period <= memory):
            raise IdentificationError(
                f'memory = {memory:g} s and period = {period:g} s: memory has to be at least 3 s '
                'and at least the period'
            )
        self.machines, self._inertias = machines, inertias
        self._memory, self._period = memory, period
        self._own, self._far = deque[FloatArray](), deque[FloatArray]()  # rows with time first
        self.reset()

    def reset(self) -> None:
        """Discard all samples and estimates."""
        self.interrupt()
        self.together: Interaction | None = None
        self.separate: Interaction | None = None
        self.slack: Slack | None = None

    def interrupt(self) -> None:
        """Discard all samples, but not the estimates, after an interruption of the motion."""
        self._own.clear()
        self._far.clear()
        self._due: float | None = None
        self._slack_due: float | None = None

    def take_other(self, t: float, q: FloatArray) -> None:
        """Add a sample of the second machine: time [s] and joint positions (m,) [rad]."""
        _add(self._far, np.concatenate([[t], q]), self._memory)

    def take(self, t: float, q: FloatArray, tau: FloatArray) -> bool:
        """
        Add a sample of the first machine, and update the estimates once per period.

        Parameters
        ----------
        t : float
            Time [s], of the same clock as the other machine's.
        q, tau : ndarray, shape (n,)
            Position [rad] and torque [N m].

        Returns
        -------
        bool
            Whether the estimates are new.

        Raises
        ------
        IdentificationError
            If the samples do not determine the stiffness, or the times of the machines do not
            overlap.

        """
        _add(self._own, np.concatenate([[t], q, tau]), self._memory)
        if self._due is None or t < self._due - 2.0 * self._memory:
            self._due = t + self._memory
            self._slack_due = self._due
        if t < self._due:
            return False
        self._due = t + self._period
        self.together = identify_interaction(self._problem(separate=False))
        self.separate = identify_interaction(self._problem(separate=True))
        assert self._slack_due is not None
        # ratio of the mean square residual to the noise above which slack is fitted
        if self.together.misfit < 1.5 * self.together.residual.size:
            self.slack = None
        elif t >= self._slack_due:
            self._slack_due = t + _SLACK_PERIOD
            self.slack = find_slack(lambda slack: self._problem(separate=False, slack=slack))
        return True

    def _problem(self, *, separate: bool, slack: float = 0.0) -> InteractionProblem:
        """Return the regression of strap stiffness for the samples in the buffers."""
        robot, other = self.machines.robot, self.machines.other
        n = robot.n_joints
        if len(self._own) < 2 or len(self._far) < 2:
            raise IdentificationError(
                f'too few joint states of {robot.name} or {other.name}; check both topics'
            )
        rows, far_rows = _averaged(self._own), _averaged(self._far)
        t, q, tau = np.split(rows, [1, n + 1], axis=1)
        own = Recording(joints=robot.joints, t=t[:, 0] - t[0, 0], q=q, tau=tau)
        far = Recording(joints=other.joints, t=far_rows[:, 0] - t[0, 0], q=far_rows[:, 1:])
        return recorded_interaction_problem(
            self.machines, own, far, inertias=self._inertias, separate=separate, slack=slack
        )
