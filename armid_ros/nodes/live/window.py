# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Buffer of constant size for the latest samples of an arm."""

from __future__ import annotations

from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Shortest time between kept samples, as a share of the period.
_MIN_SPACING = 0.75


class SampleWindow:
    """
    Latest samples of an arm, one per period, without gaps.

    Further samples are skipped, so that a period of 5 ms gives 200 samples per second at any input
    rate. Late and repeated samples are skipped too. The window is cleared after a gap or a jump
    back in time.

    Parameters
    ----------
    joints : tuple of str
        Joint names, n of them.
    duration : float
        Longest time that is kept [s].
    period : float
        Time between kept samples [s].

    Attributes
    ----------
    moved : float
        Time in which any joint moved, since the window was made [s].

    """

    def __init__(self, joints: tuple[str, ...], duration: float, period: float) -> None:
        self.joints = joints
        self.moved = 0.0
        self._period = period
        self._capacity = int(np.ceil(duration / (period * _MIN_SPACING))) + 1
        n = len(joints)
        # twice the capacity: the window is one slice, and is moved to the front when the end is
        # reached
        self._rows = np.empty((2 * self._capacity, 1 + 3 * n))
        self._first = self._end = 0

    def __len__(self) -> int:
        """Return the number of kept samples."""
        return self._end - self._first

    @property
    def begin(self) -> float:
        """Return the time of the oldest sample [s]; infinite for an empty window."""
        return float(self._rows[self._first, 0]) if len(self) else np.inf

    @property
    def end(self) -> float:
        """Return the time of the newest sample [s]; minus infinity for an empty window."""
        return float(self._rows[self._end - 1, 0]) if len(self) else -np.inf

    @property
    def nbytes(self) -> int:
        """Return the memory of the samples [bytes]."""
        return self._rows.nbytes

    def add(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> bool:
        """
        Add a sample to the window if one is due.

        Parameters
        ----------
        t : float
            Time of the sample [s].
        q, tau : array_like, shape (n,)
            Position [rad or m], torque [N m or N].
        dq : array_like, shape (n,), or None
            Velocity; None if not measured.

        Returns
        -------
        bool
            Whether the sample was kept.

        """
        step = t - self.end
        # longest gap, and longest step back in time, without a restart
        if len(self) and abs(step) > 20.0 * self._period:
            self._first = self._end = 0
        elif step < _MIN_SPACING * self._period:
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
            # at rest, no joint is faster than 0.01 rad/s or m/s
            if np.abs(row[1 : n + 1] - before[1 : n + 1]).max() > 0.01 * step:
                self.moved += step
        self._end += 1
        self._first = max(self._first, self._end - self._capacity)
        return True

    def recording(self, first: float = -np.inf, source: str = 'window') -> Recording:
        """
        Return the samples from a given time on as a recording.

        Parameters
        ----------
        first : float
            Time of the first sample [s].
        source : str
            Name of the recording.

        """
        rows = self._rows[self._first : self._end]
        rows = rows[rows[:, 0] >= first].copy()
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
