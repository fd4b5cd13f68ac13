# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What noise of the sensors does to the torques of an arm that is tied to a machine beside it.

Beside springs the noise of angles is most of what there is, and it is known from their spectra
far better than from what two periods of some seconds differ by.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.effects.tied import Tied, TiedSlack
from armid_ros.identification.interaction_problem import InteractionProblem
from armid_ros.identification.interaction_recording import together_interaction_problem
from armid_ros.identification.signals import Conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np


@dataclass(frozen=True)
class SensorNoise:
    """
    What white noise of the sensors does to the torques of an arm beside another machine.

    Attributes
    ----------
    problem : InteractionProblem
        Of the arm as described, with a spring for every tie.

    """

    problem: InteractionProblem

    @staticmethod
    def of(arm: ArmModel, recording: Recording, used: Conditioning) -> SensorNoise:
        """Measure the noise of a recording with something beside it."""
        return SensorNoise(together_interaction_problem(arm.robot, recording, used, separate=True))

    def floor(self, arm: ArmModel) -> FloatArray:
        """
        Return the standard deviation of a row beside an arm with its ties, (n,) [N m].

        Zero where straps have slack: across them they hold less than springs would.

        """
        stiffness = dict.fromkeys(self.problem.spring_joints, 0.0)
        for effect, values in zip(arm.effects, arm.values, strict=True):
            if isinstance(effect, TiedSlack):
                return np.zeros(arm.robot.n_joints)
            if isinstance(effect, Tied):
                each = len(values) // len(effect.joints)
                stiffness.update(zip(effect.joints, values[::each].tolist(), strict=True))
        return self.problem.deviation(np.array(list(stiffness.values())))
