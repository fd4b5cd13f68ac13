# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which friction elements stick: a linear complementarity problem with bounds, solved exactly.

Over one step, the velocities of m elements are w = w_free - G f, with G symmetric and positive
semidefinite (the Delassus matrix times the step) and f the torques they take. Every element obeys
its law:

    w_i > 0 and f_i = upper_i,   or   w_i < 0 and f_i = lower_i,   or   w_i = 0 and f_i between.

Source: block principal pivoting with Murty's rule as its safeguard, Judice and Pires 1994.

"""

from __future__ import annotations

from armid_ros.motion import FloatArray
import numpy as np
from scipy.linalg.lapack import dgesv

#: Share of its diagonal that is added to G. Elements that depend on one another (two joints and
#: the sum of the two) make G singular and leave their torques undetermined, never the velocities.
REGULARISATION = 1e-10

#: Rounds in which all elements that break their law change at once. Typical steps take one; some
#: problems make this cycle, from there only the first offender changes, which always ends.
BLOCK_ROUNDS = 12
ROUNDS = 500


def solve_box_complementarity(
    g: FloatArray,
    w_free: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    modes: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """
    Solve for the torques of the friction elements.

    Parameters
    ----------
    g : ndarray, shape (m, m)
        Change of velocity per torque.
    w_free : ndarray, shape (m,)
        Velocities at the end of the step without friction.
    lower, upper : ndarray, shape (m,)
        Bounds of the torques, lower < upper; infinite for a stop.
    modes : ndarray, shape (m,)
        First guess: 1.0 slips forwards, -1.0 backwards, 0.0 sticks. That of the last step is
        nearly always right.

    Returns
    -------
    torque : ndarray, shape (m,)
        f [N m], within its bounds.
    modes : ndarray, shape (m,)
        What each element does.

    """
    for rounds in range(ROUNDS):
        f = _torques(g, w_free, lower, upper, modes)
        margin, change = _judge(w_free - g.dot(f), f, lower, upper, modes)
        if min(margin) >= 0.0:
            break
        modes = modes.copy()
        for element, value in enumerate(margin):
            if value < 0.0:
                modes[element] = change[element]
                if rounds >= BLOCK_ROUNDS:
                    break
    return f, modes


def _torques(
    g: FloatArray, w_free: FloatArray, lower: FloatArray, upper: FloatArray, modes: FloatArray
) -> FloatArray:
    """Take the torques of slipping elements from their bounds, of sticking ones from w = 0."""
    at_bound = np.where(modes > 0.0, upper, lower)
    stuck = modes == 0.0
    if not np.count_nonzero(stuck):
        return at_bound
    system = np.where(stuck[:, np.newaxis], g, 0.0)
    diagonal = system.reshape(-1)[:: len(modes) + 1]
    diagonal *= 1.0 + REGULARISATION
    diagonal += ~stuck
    return np.asarray(dgesv(system, np.where(stuck, w_free, at_bound))[2])


def _judge(
    w: FloatArray, f: FloatArray, lower: FloatArray, upper: FloatArray, modes: FloatArray
) -> tuple[list[float], list[float]]:
    """Say by how much each element keeps its law (negative: breaks it), and its next mode."""
    margin, change = [], []
    for speed, torque, least, most, mode in zip(
        w.tolist(), f.tolist(), lower.tolist(), upper.tolist(), modes.tolist(), strict=True
    ):
        if mode:
            margin.append(speed * mode)
            change.append(0.0)
        else:
            margin.append(min(torque - least, most - torque))
            change.append(1.0 if torque > most else -1.0)
    return margin, change
