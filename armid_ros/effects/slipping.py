# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Slipping springs: friction that depends on the travel since the last reversal."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

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
            ends = np.sign(np.diff(own))  # of the spring: the direction of motion, -1, 0 or 1
            reversals = np.flatnonzero(np.diff(ends)) + 1
            for first, last in pairwise(np.unique([0, *reversals, len(ends)])):
                decay = np.exp(-np.abs(own[first + 1 : last + 1] - own[first]) / float(distance))
                state[first + 1 : last + 1] = ends[first] - (ends[first] - state[first]) * decay
        return states
