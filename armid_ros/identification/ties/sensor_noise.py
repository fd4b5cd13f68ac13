# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What noise of the sensors does to the torques of an arm that is tied to a machine beside it.

Beside springs the noise of angles is most of what there is, and it is known from their spectra
far better than from what two periods of some seconds differ by.

"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from armid_ros.arm import ArmModel
from armid_ros.effects.tied import Tied, TiedSlack
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.identification.ties.problem import InteractionProblem
from armid_ros.identification.ties.recorded import together_interaction_problem
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class SensorNoise:
    """
    What white noise of the sensors does to the torques of an arm beside another machine.

    Attributes
    ----------
    robot : Robot
        The arm as described.
    recording : Recording
        Of it, with what was beside it.
    used : Conditioning
        Filters.

    """

    robot: Robot
    recording: Recording
    used: Conditioning

    def floor(self, arm: ArmModel) -> FloatArray:
        """Return the standard deviation of a row beside an arm with its ties, (n,) [N m]."""
        problem = self._taut
        stiffness = dict.fromkeys(problem.spring_joints, 0.0)
        slack = dict.fromkeys(problem.spring_joints, 0.0)
        for effect, values in zip(arm.effects, arm.values, strict=True):
            if isinstance(effect, Tied):
                each = len(values) // len(effect.joints)
                stiffness.update(zip(effect.joints, values[::each].tolist(), strict=True))
            if isinstance(effect, TiedSlack):
                slack.update(zip(effect.joints, effect.slacks.tolist(), strict=True))
        if any(slack.values()):
            problem = self._problem(np.array(list(slack.values())))
        return problem.deviation(np.array(list(stiffness.values())))

    @cached_property
    def _taut(self) -> InteractionProblem:
        return self._problem(0.0)

    def _problem(self, slack: float | FloatArray) -> InteractionProblem:
        return together_interaction_problem(
            self.robot, self.recording, self.used, separate=True, slack=slack
        )
