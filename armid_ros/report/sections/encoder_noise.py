# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What encoder noise does to the parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.assess.consistency import NoiseCheck
from armid_ros.report.families import full_label
from armid_ros.report.notation import digits, pretty
from armid_ros.report.page import Section
from armid_ros.robots import Robot
import numpy as np

_WORST = 6


@dataclass(frozen=True)
class EncoderNoise(Section):
    """
    The test for errors in variables, and the bias that a simulation finds.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    check : NoiseCheck
        Both.

    """

    title: ClassVar[str] = 'Encoder noise'
    template: ClassVar[str] = 'encoder_noise.html'

    robot: Robot
    check: NoiseCheck

    @property
    def noise(self) -> str:
        """Position noise of every joint in words."""
        return ', '.join(
            f'{joint} {digits(1e3 * value)} m{unit}'
            for joint, value, unit in zip(
                self.robot.joints,
                self.check.position_noise,
                self.robot.position_units,
                strict=True,
            )
        )

    @property
    def worst(self) -> list[tuple[str, str, str, str]]:
        """Parameters with the largest bias: name, bias, its error, in standard deviations."""
        check = self.check
        order = np.argsort(-np.abs(check.relative_bias))[:_WORST]
        return [
            (
                full_label(check.instrumental.parameters[k]),
                f'{check.bias[k]:.2g} {pretty(check.instrumental.parameters[k].unit)}',
                f'{check.bias_std[k]:.1g}',
                f'{check.relative_bias[k]:+.2f}',
            )
            for k in order
        ]
