# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether messages still come."""

from __future__ import annotations

from collections.abc import Callable
import time

#: Silence after which a stream of messages has stopped [s]; who publishes joint states slower than
#: at 2 Hz has nothing to identify from.
STOPPED = 0.5


class Freshness:
    """
    How long a topic has been silent, in the time of the machine, which no clock on topics stops.

    Parameters
    ----------
    what : str
        What comes, such as 'joint states'.
    now : callable, optional
        Steady time [s].

    """

    def __init__(self, what: str, now: Callable[[], float] = time.monotonic) -> None:
        self._what = what
        self.now = now
        self._heard: float | None = None

    def heard(self) -> None:
        """Take note of a message."""
        self._heard = self.now()

    @property
    def silence(self) -> float:
        """Time since the last message [s]; 0 before the first one."""
        return 0.0 if self._heard is None else self.now() - self._heard

    @property
    def stopped(self) -> bool:
        """Whether messages came and come no more."""
        return self.silence > STOPPED

    def trouble(self) -> str:
        """Say that nothing comes; empty while something does, and before the first message."""
        return f'{self._what} stopped {self.silence:.1f} s ago' if self.stopped else ''
