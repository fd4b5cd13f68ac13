# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Monitor the arrival of messages, and the difference of stamps and clock."""

from __future__ import annotations

from collections import deque
import time

from rclpy.clock import ROSClock


class Freshness:
    """
    Measures the time since the last message of a topic, independent of /clock.

    Parameters
    ----------
    what : str
        Name of the messages, such as 'joint states'.

    """

    def __init__(self, what: str) -> None:
        self._what = what
        self.now = time.monotonic
        self._heard: float | None = None

    def heard(self) -> None:
        """Register that a message has arrived."""
        self._heard = self.now()

    @property
    def silence(self) -> float:
        """Return the time since the last message [s]; 0 before the first message."""
        return 0.0 if self._heard is None else self.now() - self._heard

    @property
    def stopped(self) -> bool:
        """Return whether messages have stopped after the first message."""
        return self.silence > 0.5  # joint states below 2 Hz are not usable for identification

    def trouble(self) -> str:
        """Return a message if the topic has stopped; empty otherwise."""
        return f'{self._what} stopped {self.silence:.1f} s ago' if self.stopped else ''


class StampDifference:
    """
    Compares the stamps of messages with their time of reception.

    Parameters
    ----------
    clock : ROSClock
        Clock of the node.

    """

    def __init__(self, clock: ROSClock) -> None:
        self._clock = clock
        self._late = 0.0
        self._recent: deque[float] = deque(maxlen=20)

    @property
    def late(self) -> float:
        """Return the smallest difference of clock and recent stamps [s]."""
        return min(self._recent, key=abs, default=0.0)

    def take(self, stamp_ns: int, now_ns: int | None = None) -> None:
        """Register the stamp of a message [ns]; 0: no stamp. By default it was received now."""
        now = self._clock.now().nanoseconds if now_ns is None else now_ns
        self._late = (now - stamp_ns) * 1e-9 if stamp_ns and now else 0.0
        self._recent.append(self._late)

    def side(self, late: float) -> str:
        """Return 'ahead of' or 'behind' and the name of the clock, for stamps with a delay [s]."""
        clock = '/clock' if self._clock.ros_time_is_active else "this computer's clock"
        return f'{"behind" if late > 0.0 else "ahead of"} {clock}'

    def of_results(self, topic: str) -> str:
        """Return a message if the stamps of results are far from the clock; empty otherwise."""
        # tf2 keeps ten seconds, so RViz cannot draw older results; up to 1000 messages in the
        # queue of a busy node are younger
        if abs(self._late) <= 10.0:
            return ''
        return (
            f'stamps of {topic} are {abs(self._late):.0f} s {self.side(self._late)}, and so are '
            'all results. Set the clocks, or use_sim_time on all nodes or on none'
        )
