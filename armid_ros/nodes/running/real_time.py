# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Run a simulation at real time times a factor, and report skipped time."""

from __future__ import annotations

from collections.abc import Callable
import time


class RealTime:
    """
    Pacing of a simulation by real time; a simulation that is too slow skips time.

    Parameters
    ----------
    elapsed : callable
        Function that returns the time of the simulation [s].
    step : callable
        Function that advances the simulation by one sample.

    Attributes
    ----------
    given_up : float
        Skipped real time [s].

    """

    def __init__(self, elapsed: Callable[[], float], step: Callable[[], object]) -> None:
        self._elapsed, self._step, self._clock = elapsed, step, time.monotonic
        self.given_up = 0.0
        self.begin()

    def begin(self) -> None:
        """Restart the pacing at the present time, without reset of the skipped time."""
        self._anchor = self._clock(), self._elapsed()

    def catch_up(self, factor: float, period: float) -> float:
        """
        Simulate up to the present real time; skip the time that cannot be caught up.

        Parameters
        ----------
        factor : float
            Simulated time per real time.
        period : float
            Simulated time of a step [s]; the loop ends after a step without progress.

        Returns
        -------
        float
            Real time that is skipped now [s].

        """
        now = self._clock()
        due = self._anchor[1] + (now - self._anchor[0]) * factor
        # return after 5 ms of work, so that services are answered
        while self._elapsed() + period <= due and self._clock() - now < 0.005:
            before = self._elapsed()
            self._step()
            if self._elapsed() <= before:
                self.begin()
                return 0.0
        behind = (due - self._elapsed()) / factor
        # A writer of Fast DDS sleeps 0.33 s where the shared memory of a new subscriber is busy. A
        # skip then would be a gap in the joint states of the other subscribers.
        if behind <= 0.5:
            return 0.0
        self.given_up += behind
        self.begin()
        return behind

    def trouble(self, advice: str) -> str:
        """Return a message on skipped time, with the advice; '' if no time was skipped."""
        if self.given_up <= 0.5:  # delays during the start are normal
            return ''
        return f'{self.given_up:.1f} s of real time were skipped: {advice}'
