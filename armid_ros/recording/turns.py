# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Remove jumps by whole turns from positions."""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np

#: One turn in each unit of positions [rad, degrees].
_TURNS = (2.0 * np.pi, 360.0)
#: Largest deviation of a jump from a whole turn, as a share of the turn.
_OFF_A_TURN = 0.15


def unwrapped(q: FloatArray) -> tuple[FloatArray, list[int]]:
    """
    Undo jumps by a whole turn.

    A joint is wrapped if its positions stay within one turn and each step of more than half a turn
    is about a whole turn. The tolerance depends on the other steps of the joint.

    Parameters
    ----------
    q : ndarray, shape (N, n)
        Positions [rad or degrees].

    Returns
    -------
    q : ndarray, shape (N, n)
        Continuous positions, shifted by whole turns to be near zero; the same object if no joint
        was wrapped.
    joints : list of int
        Indices of the wrapped joints.

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
