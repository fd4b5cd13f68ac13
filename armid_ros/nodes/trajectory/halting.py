# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether an arm that was told to stop does, and what to tell it where it does not."""

from __future__ import annotations

from collections.abc import Callable
import math

from armid_ros.excitation import Halt, held, MeasuredPose
from armid_ros.motion import Motion


class HaltWatch:
    """
    Looks whether an arm is at rest by the time that it has to be, and tells it again.

    Parameters
    ----------
    insist : callable
        Sends a motion to the controller, on all ways that there are.

    """

    def __init__(self, insist: Callable[[Motion], None]) -> None:
        self._insist = insist
        self._halt: Halt | None = None

    def forget(self) -> None:
        """Look no more: the arm is to move again."""
        self._halt = None

    def expect(self, by: float, pose: MeasuredPose, asked: int = 1) -> None:
        """
        Look from a time on whether the arm is at rest.

        Parameters
        ----------
        by : float
            When it has to be [s].
        pose : MeasuredPose
            Where it is now.
        asked : int
            How often it was told to stop.

        """
        self._halt = Halt(by, asked, -math.inf, pose.q)

    def look(self, now: float, pose: MeasuredPose, stopping: float, patience: float) -> str:
        """
        Look at the arm; tell it to stay where it is, and say so, where it goes on.

        Parameters
        ----------
        now : float
            Time of the pose [s].
        pose : MeasuredPose
            Where it is.
        stopping, patience : float
            How long it may take to come to rest, and to be seen at rest [s].

        Returns
        -------
        str
            Empty while all is well.

        """
        if self._halt is None:
            return ''
        asked = self._halt.asked
        self._halt, at_rest = self._halt.looked(now, pose.q)
        if at_rest is None:
            return ''
        self._halt = None
        if at_rest:
            return ''
        self._insist(held(pose.joints, pose.q, stopping))
        self.expect(now + stopping + patience, pose, asked + 1)
        times = 'once' if asked == 1 else f'{asked} times'
        return (
            f'the arm goes on moving though it was stopped {times}: its controller does not '
            'take trajectories any more; use the emergency stop'
        )
