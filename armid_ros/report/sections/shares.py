# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How the gap is shared out: the causes that matter, and what nothing explains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.notation import percent
from armid_ros.report.page import Section


@dataclass(frozen=True)
class Shares(Section):
    """
    Shares of the held-out gap.

    Attributes
    ----------
    diagnosis : Diagnosis
        What was found; something was.

    """

    title: ClassVar[str] = 'What explains the gap'
    template: ClassVar[str] = 'shares.html'

    diagnosis: Diagnosis

    @property
    def bars(self) -> BarChart:
        """One bar a cause, and one for the rest, in per cent of the gap."""
        rows = []
        for one in self.diagnosis.findings:
            where = ', '.join(one.place_of(joint) for joint in one.joints) or 'whole arm'
            low, high = one.share_interval
            text = f'{percent(one.share)} ({percent(low)} to {percent(high)})'
            bar = Bar(max(one.share, 0.0), 'after', text)
            rows.append((f'{one.name.replace("_", " ")}, {where}', [bar]))
        rest = max(1.0 - sum(max(one.share, 0.0) for one in self.diagnosis.findings), 0.0)
        rows.append(('the rest', [Bar(rest, 'floor', percent(rest))]))
        return BarChart(rows, '', full=1.0)

    @property
    def data(self) -> str:
        """What the shares were measured on."""
        gap = self.diagnosis.gap
        if gap is not None and gap.predicted:
            return 'on recordings that were not used'
        return 'on parts of the recordings, each predicted from the others'
