# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bars for a page, of HTML alone: they print, and fit any width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.blocks import Legend
from armid_ros.report.charts import Role
from armid_ros.report.page import Templated


@dataclass(frozen=True)
class Bar:
    """
    One bar.

    Attributes
    ----------
    value : float
        Length, in the unit of all bars; not negative.
    role : str
        What it is, which gives the colour.
    text : str
        What is written beside it.

    """

    value: float
    role: Role
    text: str


@dataclass(frozen=True)
class BarChart(Templated):
    """
    Rows of bars on a common scale from zero.

    Attributes
    ----------
    rows : sequence of (str, sequence of Bar)
        Label of each row, and its bars one below the other.
    roles : sequence of (str, str)
        Legend: role, and what it stands for.
    scale_by_row : bool
        Whether each row fills the width with its own longest bar, as for joints of different
        strength.
    full : float
        What fills the width; the longest bar if zero.

    """

    template: ClassVar[str] = 'bars.html'

    rows: Sequence[tuple[str, Sequence[Bar]]]
    roles: Sequence[tuple[Role, str]] = ()
    scale_by_row: bool = False
    full: float = 0.0

    def percent(self, row: int, bar: Bar) -> float:
        """Return how long a bar is, as a percentage of the space."""
        bars = self.rows[row][1] if self.scale_by_row else [b for _, bs in self.rows for b in bs]
        longest = self.full or max(other.value for other in bars)
        return round(100.0 * bar.value / longest, 2) if longest > 0.0 else 0.0

    @property
    def legend(self) -> Legend:
        """Return what the colours stand for."""
        return Legend(self.roles)
