# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is done between the end of a run and the arm at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

from armid_ros.errors import TrajectoryError
from armid_ros.excitation.gate import MotionGate
from armid_ros.excitation.pose_monitor import PoseMonitor
from armid_ros.motion import FloatArray, Motion
import numpy as np

#: Time that an arm has to be seen at rest [s].
_REST = 0.1
#: Largest step to where a blocked arm stands, in units of the tracking tolerance.
_RELIEF = 3.0


@dataclass(frozen=True)
class Ending:
    """
    A run that ended, until the arm is seen at rest.

    Attributes
    ----------
    gate : MotionGate
        Checks what is sent.
    begun : float
        When the run began [s].
    last : Motion or None
        Motion that was sent last, without an approach to its first sample; None: another client
        has the controller, and nothing is sent.
    sent : float
        When it was sent [s].
    reason : str
        Why the run ended.
    blocked : bool
        Whether the arm did not follow, and is to be held where it stands.
    warned : bool
        Whether it was reported that the arm goes on moving.

    """

    gate: MotionGate
    begun: float
    last: Motion | None
    sent: float
    reason: str
    blocked: bool = False
    warned: bool = False

    def set_point(self, now: float) -> FloatArray:
        """Return where the controller should have the arm, shape (n,) [rad or m]."""
        assert self.last is not None
        row = int(np.searchsorted(self.last.t, now - self.sent))
        return np.asarray(self.last.q[min(row, len(self.last.t) - 1)])

    def stopped_again(
        self, monitor: PoseMonitor, now: float, tolerance: float, duration: float
    ) -> Motion | None:
        """Return another stop for an arm that is still on the path of the run; None: it is not."""
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
        Look at the arm.

        Parameters
        ----------
        monitor : PoseMonitor
            Knows where the arm is.
        now : float
            Time [s].
        patience : float
            How long after the end of a motion the arm may still move [s].
        tolerance : float
            Distance from the set point from which an arm does not follow [rad or m].
        duration : float
            Time of another stop [s].

        Returns
        -------
        Ending or None
            What to look at next; None: the arm is at rest.
        Motion or None
            What to send.
        str
            What to report.

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
            (f'the arm goes on moving though it was stopped: {moving}; use the emergency stop'),
        )

    def _relieved(
        self, measured: FloatArray, now: float, tolerance: float
    ) -> tuple[Ending, Motion | None, str]:
        """Hold an arm where it stands, if that is a small step that may be made."""
        ending, set_point = replace(self, blocked=False), self.set_point(now)
        if np.abs(measured - set_point).max() <= tolerance:
            return ending, None, ''
        try:
            motion = self.gate.hold(set_point, measured, _RELIEF * tolerance)
        except TrajectoryError as error:
            return ending, None, f'{self.reason}; the set point stays where it is: {error}'
        return replace(ending, last=motion, sent=now), motion, ''
