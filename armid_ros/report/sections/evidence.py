# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the gap lives: the mean residual over every quantity, the telling one first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis.verdict.where import Where
from armid_ros.report.charts import Chart, Series
from armid_ros.report.page import Section

#: Joints that are shown.
_MOST = 3


@dataclass(frozen=True)
class EvidenceSection(Section):
    """
    Residuals without what was named.

    Attributes
    ----------
    places : sequence of Where
        Joints, the worst first.

    """

    title: ClassVar[str] = 'Where it lives'
    template: ClassVar[str] = 'evidence.html'

    places: Sequence[Where]

    @property
    def shown(self) -> Sequence[Where]:
        """The worst joints."""
        return self.places[:_MOST]

    def charts(self, place: Where) -> list[tuple[str, Chart]]:
        """Return a caption and a chart per quantity."""
        return [
            (
                f'{axis.name}: {100.0 * axis.share:.0f} % of the power',
                Chart(
                    axis.centres,
                    [Series('mean residual', axis.means, 'before', 'trend')],
                    f'{axis.name} [{axis.unit}]',
                    'residual [N m]',
                    height=170,
                    symmetric=True,
                    legend=False,
                ),
            )
            for axis in place.axes
        ]
