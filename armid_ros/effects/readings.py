# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Base classes of effects that change recorded positions or recorded torques.

A recording contains the readings of position sensors and of torque sensors. The torque that a
model predicts for a recorded motion is

    reading(torque(motion + displacement)),

where the displacement is the true minus the recorded motion.

"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import partial

from armid_ros.effects.action import Action, Displacement
from armid_ros.effects.base import Arm, Effect
from armid_ros.motion import FloatArray, Motion
import numpy as np


@dataclass(frozen=True)
class Displacing(Effect):
    """Base class of effects that make link positions differ from recorded positions."""

    @abstractmethod
    def displacements(self, motion: Motion, arm: Arm) -> Displacement:
        """
        Return the true minus the recorded motion of the links, per unit of each parameter.

        Returns
        -------
        Displacement
            Arrays of shape (N, n, P).

        """

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque changes that displacements per unit of parameter cause, (N, n, P)."""
        return arm.torque_change(motion, self.displacements(motion, arm))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action that displaces the links, for given parameter values."""

        def displacement(motion: Motion) -> Displacement:
            parts = self.displacements(motion, arm)
            return Displacement(*(part @ values for part in parts))

        return Action(displacement=displacement if np.any(values) else None)


@dataclass(frozen=True)
class TorqueReading(Effect):
    """Base class of sensor effects that change the recorded torque."""

    @abstractmethod
    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """
        Return the torque readings of a true torque along a motion, shape (N, n) [N m].

        Parameters
        ----------
        values : ndarray, shape (P,)
            Parameter values; zeros give the true torque.
        motion : Motion
            Motion with the time base and, if measured, the torque that the drives report.
        tau : ndarray, shape (N, n)
            True torque [N m].

        """

    def transfer(
        self, values: FloatArray, motion: Motion, tau: FloatArray, columns: FloatArray
    ) -> FloatArray:
        """
        Convert a regressor of true torques to a regressor of torque readings, shape (N, n, Q).

        The default assumes a reading linear in the torque, and applies `read` to the columns.

        """
        return self.read(values, motion, columns)

    @abstractmethod
    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return the derivatives of the reading of `tau` by the parameters, shape (N, n, P)."""

    def memory(self, values: FloatArray) -> float:
        """Return the time span of past torque that influences a reading [s]."""
        return 0.0

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the derivatives of the torque readings by the parameters, shape (N, n, P)."""
        return self.sensitivity(arm.values_of(self), motion, arm.torque_before(self, motion))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return an action that converts true torques to torque readings."""
        if not np.any(values):
            return Action()
        return Action(reading=partial(self.read, values), reading_memory=self.memory(values))
