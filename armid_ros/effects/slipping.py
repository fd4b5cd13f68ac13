# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Slipping springs: friction that depends on the travel since the last reversal."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class Hysteresis:
    """
    Friction of m slipping springs, which grows with the travel since the last reversal.

    The state h of an element, from -1 to 1, follows dh = (1 - h sign(dx)) |dx| / distance along
    its travel x, at any speed. Its torque is level * h.
    Source: Dahl 1968 with exponent 1.

    Attributes
    ----------
    directions : ndarray, shape (m, n)
        Travel of each element as a combination of the joint positions.
    level : ndarray, shape (m,)
        Torque after a long travel [N m].
    distance : ndarray, shape (m,)
        Travel from rest after which 1 - 1/e of the level is reached [rad or m].

    """

    directions: FloatArray
    level: FloatArray
    distance: FloatArray

    def start(self, dq: FloatArray) -> FloatArray:
        """Return the spring states (m,) after a long motion with constant velocity."""
        return np.asarray(np.sign(self.directions @ dq))

    def advance(self, state: FloatArray, moved: FloatArray) -> FloatArray:
        """Return the spring states (m,) after joint displacements [rad or m] without reversal."""
        travel = self.directions @ moved
        end = np.sign(travel)
        return np.asarray(end - (end - state) * np.exp(-np.abs(travel) / self.distance))

    def torque(self, state: FloatArray) -> FloatArray:
        """Return the joint torques (..., n) [N m] for spring states (..., m)."""
        return np.asarray((self.level * state) @ self.directions)

    def along(self, q: FloatArray, dq: FloatArray) -> FloatArray:
        """
        Return the spring states at each sample of a joint motion, shape (N, m).

        Parameters
        ----------
        q, dq : ndarray, shape (N, n)
            Joint positions, in order of time, and velocities.

        """
        travel = q @ self.directions.T
        states = np.empty_like(travel)
        moves = np.abs(dq[0]) > 0.02 * np.abs(dq).max(axis=0)  # slower motion is sensor noise
        states[0] = self.start(np.where(moves, dq[0], 0.0))
        for element, distance in enumerate(self.distance):
            own, state = travel[:, element], states[:, element]
            for first, last, end in _monotone_parts(own):
                decay = np.exp(-np.abs(own[first + 1 : last + 1] - own[first]) / float(distance))
                state[first + 1 : last + 1] = end - (end - state[first]) * decay
        return states


def _monotone_parts(travel: FloatArray) -> list[tuple[int, int, float]]:
    """Return (first sample, last sample, direction +-1 or 0) of each motion between reversals."""
    step = np.sign(np.diff(travel))
    turns = np.flatnonzero(np.diff(step)) + 1
    ends = zip(np.append(0, turns), np.append(turns, len(step)), strict=True)
    return [(int(a), int(b), float(step[a])) for a, b in ends if b > a]
