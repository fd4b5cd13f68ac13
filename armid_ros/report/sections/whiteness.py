# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the residual is noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification import Fit
from armid_ros.report.charts import Chart, Level, Series
from armid_ros.report.page import Section
from armid_ros.report.statistics import Whiteness
from armid_ros.robots import Robot


@dataclass(frozen=True)
class WhitenessSection(Section):
    """
    Autocorrelation of the residuals with the band of white noise.

    Attributes
    ----------
    robot : Robot
        Gives the joints.
    fits : sequence of Fit
        Data whose residual is looked at.
    role : str
        'held-out' or 'training'.

    """

    title: ClassVar[str] = 'Whiteness'
    template: ClassVar[str] = 'whiteness.html'

    robot: Robot
    fits: Sequence[Fit]
    role: str

    @property
    def joints(self) -> list[tuple[str, float, Chart]]:
        """Joint, share of lags outside the band, and the chart."""
        found = []
        for joint, name in enumerate(self.robot.joints):
            whiteness = Whiteness.of(self.fits, joint)
            levels = [Level(whiteness.band, '99 %'), Level(-whiteness.band)]
            chart = Chart(
                whiteness.lag,
                [Series('autocorrelation', whiteness.correlation, 'residual', 'sticks')],
                'lag [s]',
                'autocorrelation',
                height=150,
                levels=levels,
                symmetric=True,
                legend=False,
            )
            found.append((name, whiteness.outside, chart))
        return found
