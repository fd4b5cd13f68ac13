# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Supervision of an arm from the end of a run until the arm is at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.gate import MotionGate
from armid_ros.excitation.pose_monitor import PoseMonitor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Time for which an arm has to be measured at rest [s].
_REST = 0.1
#: Largest step of the set point to a blocked arm, in units of the tracking tolerance.
_RELIEF = 3.0


@dataclass(frozen=True)
class Ending:
    """
    State of a run that ended, until the arm is measured at rest.

    Attributes
    ----------
    gate : MotionGate
        Check of every motion that is sent.
    begun : float
        When the run began [s].
    last : Motion or None
        Motion that was sent last, without an approach to its first sample. None: another client
        uses the controller, and no motion is sent.
    sent : float
        Time at which the motion was sent [s].
    reason : str
        Why the run ended.
    blocked : bool
        Whether the arm did not follow and has to be held at its present position.
    warned : bool
        Whether a warning that the arm still moves was reported.

    """

    gate: MotionGate
    begun: float
    last: Motion | None
    sent: float
    reason: str
    blocked: bool = False
    warned: bool = False

    def set_point(self, now: float) -> FloatArray:
        """Return the set point of the controller, shape (n,) [rad or m]."""
        assert self.last is not None
        row = int(np.searchsorted(self.last.t, now - self.sent))
        return np.asarray(self.last.q[min(row, len(self.last.t) - 1)])

    def stopped_again(
        self, monitor: PoseMonitor, now: float, tolerance: float, duration: float
    ) -> Motion | None:
        """Return a new stop if the arm still moves along the path of the run; otherwise None."""
        phase = now - self.begun
        if self.last is None or now - self.sent < self.last.t[-1]:
            return None
        if not 0.0 <= phase < self.gate.run.duration:
            return None
        away = np.abs(monitor.pose.q - self.gate.run.at([phase]).q[0]).max()
        if not away <= tolerance or not monitor.unsteady(_REST, 2):
            return None
        return self.gate.stop(phase, duration, monitor.pose.q, monitor.velocity())

    def looked(
        self,
        monitor: PoseMonitor,
        now: float,
        patience: float,
        tolerance: float,
        duration: float,
    ) -> tuple[Ending | None, Motion | None, str]:
        """
        Check whether the arm is at rest, and return the next state.

        Parameters
        ----------
        monitor : PoseMonitor
            Measured positions of the arm.
        now : float
            Time [s].
        patience : float
            How long after the end of a motion the arm may still move [s].
        tolerance : float
            Largest distance from the set point of an arm that follows [rad or m].
        duration : float
            Duration of a new stop [s].

        Returns
        -------
        Ending or None
            The next state; None: the arm is at rest.
        Motion or None
            Motion to send, if any.
        str
            Message to report; empty if none.

        """
        if self.last is not None and self.blocked and monitor.unsteady(_REST) == '':
            return self._relieved(monitor.pose.q, now, tolerance)
        lasts = 0.0 if self.last is None else float(self.last.t[-1])
        moving = monitor.unsteady(_REST, 2)
        if now - self.sent < lasts + patience or moving is None:
            return self, None, ''
        if not moving:
            return None, None, ''
        motion = self.stopped_again(monitor, now, tolerance, duration)
        ending = replace(self, warned=True)
        if motion is not None:
            ending = replace(ending, last=motion, sent=now)
        if self.warned:
            return ending, motion, ''
        if self.last is None:
            return ending, None, f'{self.reason}; {moving}, and this node does not move it'
        return (
            ending,
            motion,
            (f'the arm still moves although it was stopped: {moving}; use the emergency stop'),
        )

    def _relieved(
        self, measured: FloatArray, now: float, tolerance: float
    ) -> tuple[Ending, Motion | None, str]:
        """Hold a blocked arm at its present position, if the step of the set point is allowed."""
        ending, set_point = replace(self, blocked=False), self.set_point(now)
        if np.abs(measured - set_point).max() <= tolerance:
            return ending, None, ''
        try:
            motion = self.gate.hold(set_point, measured, _RELIEF * tolerance)
        except TrajectoryError as error:
            return ending, None, f'{self.reason}; the set point stays where it is: {error}'
        return replace(ending, last=motion, sent=now), motion, ''
