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
        """Store the present time as the arrival time of the last message."""
        self._received = self.now()

    @property
    def silence(self) -> float:
        """Time since the last message [s]; 0 if no message has arrived."""
        return 0.0 if self._received is None else self.now() - self._received

    @property
    def stopped(self) -> bool:
        """Whether messages had arrived, but no longer arrive."""
        return self.silence > 0.5  # joint states below 2 Hz are not usable for identification

    def trouble(self) -> str:
        """Return a message on how long no message has arrived; '' if messages arrive."""
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
        """Smallest recent delay of time stamps relative to the clock [s]; negative if early."""
        return min(self._recent, key=abs, default=0.0)

    def take(self, stamp_ns: int, now_ns: int | None = None) -> None:
        """Add a message's time stamp and time of reception [ns]; stamp 0 counts as no delay."""
        now = self._clock.now().nanoseconds if now_ns is None else now_ns
        self._late = (now - stamp_ns) * 1e-9 if stamp_ns and now else 0.0
        self._recent.append(self._late)

    def side(self, late: float) -> str:
        """Return 'behind' or 'ahead of', and the name of the clock, for a delay `late` [s]."""
        clock = '/clock' if self._clock.ros_time_is_active else "this computer's clock"
        return f'{"behind" if late > 0.0 else "ahead of"} {clock}'

    def of_results(self, topic: str) -> str:
        """Return a warning if time stamps differ from the clock by more than 10 s; else ''."""
        # tf2 keeps ten seconds, so RViz cannot draw older results; up to 1000 messages in the
        # queue of a busy node are younger
        if abs(self._late) <= 10.0:
            return ''
        return (
            f'stamps of {topic} are {abs(self._late):.0f} s {self.side(self._late)}, and so are '
            'all results. Set the clocks, or use_sim_time on all nodes or on none'
        )
