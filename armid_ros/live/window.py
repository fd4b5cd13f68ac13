# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What came from an arm lately: some of the samples, in memory that does not grow."""

from __future__ import annotations

from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: A sample that is so much earlier than one is due counts as due, as a share of the period.
_EARLY = 0.25
#: Below it in all joints a sample is no motion [rad/s or m/s].
_REST_VELOCITY = 0.01
#: Periods without a sample after which the stretch is broken, for its spectrum would have a hole;
#: a step back in time that is as long is none of samples out of order.
_LONGEST_GAP = 20.0


class SampleWindow:
    """
    The latest samples of an arm, one of each period, without a gap among them.

    Samples in between are left out, so that a period of 5 ms makes 200 samples a second of a
    stream of any rate. A sample that comes late or twice is left out too. Where time jumps back or
    nothing comes for long the window begins anew.

    Parameters
    ----------
    joints : tuple of str
        Joint names, n of them.
    duration : float
        What is kept at most [s].
    period : float
        Between samples that are kept [s].

    Attributes
    ----------
    moved : float
        Time in which any joint moved, since the window was made [s].

    """

    def __init__(self, joints: tuple[str, ...], duration: float, period: float) -> None:
        self.joints = joints
        self.moved = 0.0
        self._period = period
        self._capacity = int(np.ceil(duration / (period * (1.0 - _EARLY)))) + 1
        n = len(joints)
        # twice the room: rows move to the front once in a while, and a window is one slice
        self._rows = np.empty((2 * self._capacity, 1 + 3 * n))
        self._first = self._end = 0

    def __len__(self) -> int:
        """Return the number of samples that are kept."""
        return self._end - self._first

    @property
    def begin(self) -> float:
        """Time of the oldest sample [s]; infinite without any."""
        return float(self._rows[self._first, 0]) if len(self) else np.inf

    @property
    def end(self) -> float:
        """Time of the newest sample [s]; minus infinity without any."""
        return float(self._rows[self._end - 1, 0]) if len(self) else -np.inf

    @property
    def nbytes(self) -> int:
        """Memory of the samples [bytes]."""
        return self._rows.nbytes

    def add(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> bool:
        """
        Take a sample into the window if one is due.

        Parameters
        ----------
        t : float
            When it was [s].
        q, tau : array_like, shape (n,)
            Position [rad or m], torque [N m or N].
        dq : array_like, shape (n,), or None
            Velocity, where it is measured.

        Returns
        -------
        bool
            Whether it was kept.

        """
        since = t - self.end
        if len(self) and abs(since) > _LONGEST_GAP * self._period:
            self._first = self._end = 0
        elif since < (1.0 - _EARLY) * self._period:
            return False
        if self._end == len(self._rows):
            kept = self._rows[self._first : self._end].copy()
            self._rows[: len(kept)] = kept
            self._first, self._end = 0, len(kept)
        n = len(self.joints)
        row = self._rows[self._end]
        row[0], row[1 : n + 1], row[2 * n + 1 :] = t, q, tau
        row[n + 1 : 2 * n + 1] = np.nan if dq is None else dq
        if len(self):
            before = self._rows[self._end - 1]
            step = row[0] - before[0]
            if np.abs(row[1 : n + 1] - before[1 : n + 1]).max() > _REST_VELOCITY * step:
                self.moved += step
        self._end += 1
        self._first = max(self._first, self._end - self._capacity)
        return True

    def recording(self, since: float = -np.inf, source: str = 'window') -> Recording:
        """
        Return the samples from some time on as a recording.

        Parameters
        ----------
        since : float
            Time [s].
        source : str
            Its name.

        """
        rows = self._rows[self._first : self._end]
        rows = rows[rows[:, 0] >= since].copy()
        n = len(self.joints)
        dq = rows[:, n + 1 : 2 * n + 1]
        begin = rows[0, 0] if len(rows) else 0.0
        return Recording(
            joints=self.joints,
            t=rows[:, 0] - begin,
            q=rows[:, 1 : n + 1],
            dq=None if np.isnan(dq).any() else dq,
            tau=rows[:, 2 * n + 1 :],
            source=source,
        )
