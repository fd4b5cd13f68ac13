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
    Friction of m springs that slip: it grows with the travel since the last reversal.

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

    def advance(self, state: FloatArray, dq: FloatArray) -> FloatArray:
        """Return the spring states after a joint displacement dq without reversal."""
        travel = self.directions @ dq
        end = np.sign(travel)
        return np.asarray(end - (end - state) * np.exp(-np.abs(travel) / self.distance))

    def torque(self, state: FloatArray) -> FloatArray:
        """Return the joint torques (..., n) [N m] for spring states (..., m)."""
        return np.asarray((self.level * state) @ self.directions)

    def along(self, q: FloatArray, dq: FloatArray) -> FloatArray:
        """
        Return the spring states in each sample of a joint motion, shape (N, m).

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

    def pullback(self, q: FloatArray, dq: FloatArray, weights: FloatArray) -> FloatArray:
        """
        Return the derivative by joint positions of a weighted sum of torques along a motion.

        Parameters
        ----------
        q, dq : ndarray, shape (N, n)
            Positions and velocities, as for ``along``.
        weights : ndarray, shape (N, n)
            Weight of each joint torque.

        Returns
        -------
        ndarray, shape (N, n)
            Derivative by q.

        """
        travel, states = q @ self.directions.T, self.along(q, dq)
        by_state = (weights @ self.directions.T) * self.level
        by_travel = np.zeros_like(travel)
        for element in np.flatnonzero(by_state.any(axis=0)):
            path, state, distance = travel[:, element], states[:, element], self.distance[element]
            # backwards, because a stretch starts in the final state of the previous one
            for first, last, end in reversed(_monotone_parts(path)):
                own = slice(first + 1, last + 1)
                decay = np.exp(-np.abs(path[own] - path[first]) / distance)
                slope = by_state[own, element] * (end - state[own]) * end / distance
                by_travel[own, element] += slope
                by_travel[first, element] -= slope.sum()
                by_state[first, element] += by_state[own, element] @ decay
        return np.asarray(by_travel @ self.directions)


def _monotone_parts(travel: FloatArray) -> list[tuple[int, int, float]]:
    """Return each motion between two reversals: first sample, last sample, direction."""
    step = np.sign(np.diff(travel))
    turns = np.flatnonzero(np.diff(step)) + 1
    ends = zip(np.append(0, turns), np.append(turns, len(step)), strict=True)
    return [(int(a), int(b), float(step[a])) for a, b in ends if b > a]
