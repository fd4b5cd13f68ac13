# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How well the motion shows the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.charts import Chart, Series
from armid_ros.report.families import full_label
from armid_ros.report.page import Section
from armid_ros.report.statistics import Direction
import numpy as np

_WORST = 6


@dataclass(frozen=True)
class ExcitationSection(Section):
    """
    Condition number and the combinations of parameters that are known worst.

    Attributes
    ----------
    condition_number : float
        Of the weighted base regressor.
    rank : int
        Number of parameters that this motion tells apart.
    directions : sequence of Direction
        Worst known first.
    links : sequence of str
        Names of the links, in the order of their numbers.

    """

    title: ClassVar[str] = 'Excitation'
    template: ClassVar[str] = 'excitation.html'

    condition_number: float
    rank: int
    directions: Sequence[Direction]
    links: Sequence[str] = ()

    @property
    def worst(self) -> list[tuple[str, float]]:
        """Worst known combinations in words, with their uncertainty."""
        return [
            (
                ', '.join(
                    f'{full_label(name, self.links)} {100.0 * share:.0f} %'
                    for name, share in direction.parts
                ),
                direction.uncertainty,
            )
            for direction in self.directions[:_WORST]
        ]

    @property
    def chart(self) -> Chart:
        """Uncertainty of all combinations."""
        values = np.array([direction.uncertainty for direction in self.directions])
        return Chart(
            np.arange(1.0, len(values) + 1.0),
            [Series('uncertainty', values, 'residual', 'sticks')],
            'combination of parameters, worst known first',
            'uncertainty / residual',
            height=190,
            legend=False,
        )
