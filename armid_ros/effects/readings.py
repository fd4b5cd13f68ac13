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
    """Base class of effects by which the link positions differ from the recorded ones."""

    @abstractmethod
    def displacements(self, motion: Motion, arm: Arm) -> Displacement:
        """
        Return true minus recorded motion of the links, per unit of each parameter.

        Returns
        -------
        Displacement
            Arrays of shape (N, n, P).

        """

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the torque change by link displacements per unit of parameter, (N, n, P)."""
        return arm.torque_change(motion, self.displacements(motion, arm))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the link displacements for given parameter values, for plant and sensors."""

        def displacement(motion: Motion) -> Displacement:
            parts = self.displacements(motion, arm)
            return Displacement(*(part @ values for part in parts))

        return Action(displacement=displacement if np.any(values) else None)


@dataclass(frozen=True)
class TorqueReading(Effect):
    """Base class of sensor effects, which change the recorded torque."""

    @abstractmethod
    def read(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """
        Return the torque readings for a true torque along a motion, shape (N, n) [N m].

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
        Convert the regressor of true torques to that of torque readings, shape (N, n, Q).

        By default, the reading is linear in the torque, and `read` takes columns as well.

        """
        return self.read(values, motion, columns)

    @abstractmethod
    def sensitivity(self, values: FloatArray, motion: Motion, tau: FloatArray) -> FloatArray:
        """Return derivatives of the reading of a torque `tau` by the parameters, (N, n, P)."""

    def memory(self, values: FloatArray) -> float:
        """Return for how long past torques influence the reading [s]."""
        return 0.0

    def columns(self, motion: Motion, arm: Arm) -> FloatArray:
        """Return the derivatives of the torque reading by the parameters, shape (N, n, P)."""
        return self.sensitivity(arm.values_of(self), motion, arm.torque_before(self, motion))

    def action(self, values: FloatArray, arm: Arm) -> Action:
        """Return the function from true torque to reading, for the sensors."""
        if not np.any(values):
            return Action()
        return Action(reading=partial(self.read, values), reading_memory=self.memory(values))
