# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Monitor the arrival of messages, and the difference between their stamps and a clock."""

from __future__ import annotations

from collections import deque
import time

from rclpy.clock import ROSClock


class Freshness:
    """
    Age of the last message of a topic in real time, independent of /clock.

    Parameters
    ----------
    kind : str
        Name of the messages, such as 'joint states'.

    """

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self.now = time.monotonic
        self._received: float | None = None

    def mark_received(self) -> None:
        """Note that a message has arrived now."""
        self._received = self.now()

    @property
    def silence(self) -> float:
        """Return the time since the last message [s]; 0 if there was none."""
        return 0.0 if self._received is None else self.now() - self._received

    @property
    def stopped(self) -> bool:
        """Whether messages have arrived and then stopped."""
        return self.silence > 0.5  # joint states below 2 Hz are not usable for identification

    def trouble(self) -> str:
        """Return a text on how long messages have been missing; empty if messages arrive."""
        return f'{self._kind} stopped {self.silence:.1f} s ago' if self.stopped else ''


class StampDifference:
    """
    Difference between message time stamps and the clock of the receiving node.

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
        """Smallest recent delay of time stamps behind the clock [s]; negative if ahead."""
        return min(self._recent, key=abs, default=0.0)

    def take(self, stamp_ns: int, now_ns: int | None = None) -> None:
        """Add a message's time stamp and time of reception [ns]; stamp 0 counts as no delay."""
        now = self._clock.now().nanoseconds if now_ns is None else now_ns
        self._late = (now - stamp_ns) * 1e-9 if stamp_ns and now else 0.0
        self._recent.append(self._late)

    def side(self, late: float) -> str:
        """Return 'behind' or 'ahead of' and the clock's name, for a delay of stamps [s]."""
        clock = '/clock' if self._clock.ros_time_is_active else "this computer's clock"
        return f'{"behind" if late > 0.0 else "ahead of"} {clock}'

    def of_results(self, topic: str) -> str:
        """Return a warning if stamps of inputs and results are over 10 s off the clock."""
        # tf2 keeps ten seconds, so RViz cannot draw older results; up to 1000 messages in the
        # queue of a busy node are younger
        if abs(self._late) <= 10.0:
            return ''
        return (
            f'stamps of {topic} are {abs(self._late):.0f} s {self.side(self._late)}, and so are '
            'all results. Set the clocks, or use_sim_time on all nodes or on none'
        )
