# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A simulation that goes as fast as real time, times a factor, and says where it cannot."""

from __future__ import annotations

from collections.abc import Callable
import time

#: Longest stretch of work before services are answered, and backlog that is given up [s].
_BURST = 0.005
_BACKLOG = 0.2
#: Time skipped from which on it is said [s]; a start may take as long.
_BEHIND = 0.5


class RealTime:
    """
    How far a simulation is due, and by how much it is behind.

    Parameters
    ----------
    elapsed : callable
        Returns the time of the simulation [s].
    step : callable
        Takes it one sample further.

    Attributes
    ----------
    given_up : float
        Real time that could not be made up [s].

    """

    def __init__(self, elapsed: Callable[[], float], step: Callable[[], object]) -> None:
        self._elapsed, self._step, self._clock = elapsed, step, time.monotonic
        self.given_up = 0.0
        self.begin()

    def begin(self) -> None:
        """Go on from now; what was given up is kept."""
        self._anchor = self._clock(), self._elapsed()

    def catch_up(self, factor: float, period: float) -> float:
        """
        Move as far as real time has, times a factor; what cannot be made up is given up.

        Parameters
        ----------
        factor : float
            Simulated time per real time.
        period : float
            What a step takes the simulation further by [s]; one that takes it nowhere ends it.

        Returns
        -------
        float
            Real time that is given up now [s].

        """
        now = self._clock()
        due = self._anchor[1] + (now - self._anchor[0]) * factor
        while self._elapsed() + period <= due and self._clock() - now < _BURST:
            before = self._elapsed()
            self._step()
            if self._elapsed() <= before:
                self.begin()
                return 0.0
        behind = (due - self._elapsed()) / factor
        if behind <= _BACKLOG:
            return 0.0
        self.given_up += behind
        self.begin()
        return behind

    def trouble(self, advice: str) -> str:
        """Say how much was skipped, and what to do; empty where it keeps up."""
        if self.given_up <= _BEHIND:
            return ''
        return f'{self.given_up:.1f} s of real time were skipped: {advice}'
