# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Buffer of constant size for the latest samples of an arm."""

from __future__ import annotations

from collections import deque
from itertools import takewhile

from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Shortest time between kept samples, as a share of the period.
_MIN_SPACING = 0.75


class SampleWindow:
    """
    Latest samples of an arm, at constant rate and without gaps.

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
        capacity = int(np.ceil(duration / (period * _MIN_SPACING))) + 1
        self._rows: deque[FloatArray] = deque(maxlen=capacity)  # t, q, dq, tau
        # smallest and largest efforts of the arm in motion
        self._efforts = np.full((2, len(joints)), np.nan)

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self._rows)

    @property
    def begin(self) -> float:
        """Time of the oldest sample [s]; infinite if the window is empty."""
        return float(self._rows[0][0]) if self._rows else np.inf

    @property
    def end(self) -> float:
        """Time of the newest sample [s]; minus infinity if the window is empty."""
        return float(self._rows[-1][0]) if self._rows else -np.inf

    @property
    def frozen(self) -> bool:
        """
        Whether positions are constant while efforts vary.

        The efforts of an arm at rest are constant except for noise. If no position changes while
        an effort varies over half of its range in motion, the positions are not measured.

        """
        n, latest = len(self.joints), reversed(self._rows)
        q = self._rows[-1][1 : n + 1] if self._rows else np.empty(n)
        same = list(takewhile(lambda row: np.array_equal(row[1 : n + 1], q), latest))
        if not same or same[0][0] - same[-1][0] <= 2.0:  # without a change of positions [s]
            return False
        tau = np.array(same)[:, 2 * n + 1 :]
        effort, steps = np.ptp(tau, axis=0), np.abs(np.diff(tau, axis=0))
        # noise of a million samples has a range of 9 mean changes per sample
        varies = effort > 10.0 * steps.mean(axis=0)
        return bool(np.any(varies & (effort > 0.5 * np.ptp(self._efforts, axis=0))))

    def add(
        self, t: float, q: npt.ArrayLike, dq: npt.ArrayLike | None, tau: npt.ArrayLike
    ) -> bool:
        """
        Add a sample of the arm, unless the sample follows the previous sample too early.

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
        # a longer gap, or a longer step back in time, clears the window
        if self._rows and abs(step) > 20.0 * self._period:
            self._rows.clear()
        elif step < _MIN_SPACING * self._period:
            return False
        n = len(self.joints)
        row = np.empty(1 + 3 * n)
        row[0], row[1 : n + 1], row[2 * n + 1 :] = t, q, tau
        row[n + 1 : 2 * n + 1] = np.nan if dq is None else dq
        if self._rows:
            distance = np.abs(row[1 : n + 1] - self._rows[-1][1 : n + 1]).max()
            if distance > 0.01 * step:  # at rest, no joint is faster than 0.01 rad/s or m/s
                self.moved += step
                self._efforts[0] = np.fmin(self._efforts[0], row[2 * n + 1 :])
                self._efforts[1] = np.fmax(self._efforts[1], row[2 * n + 1 :])
        self._rows.append(row)
        return True

    def recording(self, first: float = -np.inf, source: str = 'window') -> Recording:
        """
        Return the samples since the time `first` as a recording.

        Parameters
        ----------
        first : float
            Time of the first sample [s].
        source : str
            Name of the recording.

        """
        n = len(self.joints)
        rows = np.array(self._rows).reshape(-1, 1 + 3 * n)
        rows = rows[rows[:, 0] >= first]
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
