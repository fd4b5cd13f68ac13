# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether messages still come, and how far their stamps are from the clock of a node."""

from __future__ import annotations

from collections import deque
import time

from rclpy.clock import ROSClock

#: Silence after which a stream of messages has stopped [s]; who publishes joint states slower than
#: at 2 Hz has nothing to identify from.
STOPPED = 0.5
#: How old results may be when they are published [s]: tf2, and so RViz, keeps ten seconds, and
#: nothing that was measured is drawn of what is older. What waits while a node is busy, 1000
#: messages at most, is younger.
SHOWN = 10.0
#: Messages of which the one that waited least shows the difference of the clocks.
_RECENT = 20


class Freshness:
    """
    How long a topic has been silent, in the time of the machine, which no clock on topics stops.

    Parameters
    ----------
    what : str
        What comes, such as 'joint states'.

    """

    def __init__(self, what: str) -> None:
        self._what = what
        self.now = time.monotonic
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


class StampDifference:
    """
    Compares the stamps of messages with the time at which they come.

    Parameters
    ----------
    clock : ROSClock
        Of the node.

    """

    def __init__(self, clock: ROSClock) -> None:
        self._clock = clock
        self._late = 0.0
        self._recent: deque[float] = deque(maxlen=_RECENT)

    @property
    def late(self) -> float:
        """Smallest difference of the last stamps from the clock [s]: a message may wait."""
        return min(self._recent, key=abs, default=0.0)

    def take(self, stamp_ns: int) -> None:
        """Take note of the stamp of a message that came now [ns]; 0: it has none."""
        now = self._clock.now().nanoseconds
        self._late = (now - stamp_ns) * 1e-9 if stamp_ns and now else 0.0
        self._recent.append(self._late)

    def of_start(self, topic: str, allowed: float, simulated: bool) -> str:
        """
        Return why a trajectory that is stamped with the time of the node must not be sent.

        A controller with another clock begins it later or further on by the difference. A small
        difference is compensated.

        Parameters
        ----------
        topic : str
            Where the stamps are from.
        allowed : float
            How far they may be from the clock [s].
        simulated : bool
            Whether the arm is.

        """
        late, now = self.late, self._clock.now().nanoseconds * 1e-9
        if not abs(late) > allowed:
            return ''
        advice = 'set the clocks, or zero_stamp:=true'
        if simulated:
            advice = 'use_sim_time on both nodes or on neither'
        return (
            f'stamps of {topic} are {abs(late):.3g} s {self._side(late)} ({now - late:.3f} s and '
            f'{now:.3f} s), more than {allowed:.3g} s: {advice}'
        )

    def _side(self, late: float) -> str:
        clock = '/clock' if self._clock.ros_time_is_active else "this computer's clock"
        return f'{"behind" if late > 0.0 else "ahead of"} {clock}'

    def of_results(self, topic: str) -> str:
        """Say what follows for results, which carry the stamps of what they were made of."""
        if abs(self._late) <= SHOWN:
            return ''
        return (
            f'stamps of {topic} are {abs(self._late):.0f} s {self._side(self._late)}, and so are '
            'those of what is made of them: set the clocks, or use_sim_time on all nodes or on '
            'none'
        )
