# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Positions kept within one turn."""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np

#: A whole turn in the units that positions come in [rad, degrees].
_TURNS = (2.0 * np.pi, 360.0)
#: What a step that is a jump by a whole turn may be off it, as a share of the turn.
_OFF_A_TURN = 0.15


def unwrapped(q: FloatArray) -> tuple[FloatArray, list[int]]:
    """
    Undo jumps by a whole turn.

    A joint is wrapped if it stays within one turn and every step of more than half a turn is one
    of a whole turn but for what the joint moves otherwise.

    Parameters
    ----------
    q : ndarray, shape (N, n)
        Positions [rad or degrees].

    Returns
    -------
    q : ndarray, shape (N, n)
        Continuous positions, by whole turns as near to zero as may be; the same object where
        nothing was wrapped.
    joints : list of int
        Those that were.

    """
    steps = np.diff(q, axis=0)
    found: list[int] = []
    largest = np.max(np.abs(steps), axis=0, initial=0.0)
    for joint in np.flatnonzero(largest > (1.0 - _OFF_A_TURN) * _TURNS[0]).tolist():
        step = steps[:, joint]
        for turn in _TURNS:
            far = np.abs(step) > 0.5 * turn
            off = np.abs(np.abs(step[far]) - turn)
            usual = np.max(np.abs(step[~far]), initial=0.0)
            within = np.ptp(q[:, joint]) <= turn * (1.0 + 1e-3)
            if (
                far.any()
                and within
                and np.all(off < min(_OFF_A_TURN * turn, 3.0 * usual + 1e-3 * turn))
            ):
                whole = q[:, joint].copy()
                whole[1:] -= turn * np.cumsum(np.where(far, np.sign(step), 0.0))
                whole -= turn * np.round(0.5 * (whole.min() + whole.max()) / turn)
                q = q.copy() if not found else q
                q[:, joint] = whole
                found.append(joint)
                break
    return q, found
