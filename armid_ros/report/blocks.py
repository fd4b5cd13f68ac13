# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Building blocks of pages: paragraph, table, list, bar chart, fold, verdict box."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.report.charts import Role
from armid_ros.report.page import Section, Templated
from markupsafe import Markup


@dataclass(frozen=True)
class Paragraph(Templated):
    """
    Paragraph of text on a page.

    Attributes
    ----------
    text : str
        Text.
    kind : str
        'hint' for small print, 'code' for text of a file.

    """

    template: ClassVar[str] = 'text.html'

    text: str
    kind: str = ''


@dataclass(frozen=True)
class TableCell:
    """
    Table cell with a style, small print or a shaded background.

    Attributes
    ----------
    text : str
        Content.
    kind : str
        Class of the style sheet, such as 'telling', 'changed' or 'unknown'.
    note : str
        Small print below it.
    shade : int
        Strength of its background [%].

    """

    text: str
    kind: str = ''
    note: str = ''
    shade: int = 0


@dataclass(frozen=True)
class IntervalTrack:
    """
    Table cell that draws an interval and a reference value on an axis.

    Attributes
    ----------
    value, reach : float
        Middle and half width of the interval.
    reference : float or None
        Reference value; None without a reference.

    """

    value: float
    reach: float
    reference: float | None

    def place(self, number: float) -> float:
        """Return the position of a number on the axis, in per cent of the axis width."""
        span = max(abs(self.value) + self.reach, abs(self.reference or 0.0)) or 1.0
        return round(50.0 + 45.0 * max(-1.0, min(1.0, number / span)), 2)


#: Cells of a row.
Cells = Sequence[str | TableCell | IntervalTrack]


@dataclass(frozen=True)
class DataTable(Templated):
    """
    Table of a page.

    Attributes
    ----------
    heads : sequence of str
        Headings of the columns; may be empty.
    rows : sequence of sequence of (str, TableCell or IntervalTrack)
        Cells.
    words : collection of int
        Indices of the columns with text; all other columns have numbers.
    kind : str
        'parameters', 'matrix' or 'fleet'. On a small screen, wide tables of no kind or of a fleet
        become lists: each cell has the head of its column.

    """

    template: ClassVar[str] = 'table.html'

    heads: Sequence[str]
    rows: Sequence[Cells]
    words: Sequence[int] = (0,)
    kind: str = ''


@dataclass(frozen=True)
class FactList(Templated):
    """
    List of facts: each line has a name and a value.

    Attributes
    ----------
    rows : sequence of (str, str)
        In order.

    """

    template: ClassVar[str] = 'facts.html'

    rows: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class BulletList(Templated):
    """
    Bulleted or numbered list.

    Attributes
    ----------
    items : sequence of (str, str)
        Text, and 'fine' (tick), 'warn' (warning sign) or ''.
    numbered : bool
        Whether the items are numbered.

    """

    template: ClassVar[str] = 'bullets.html'

    items: Sequence[tuple[str, str]]
    numbered: bool = False


@dataclass(frozen=True)
class Fold(Templated):
    """
    Summary line that shows or hides the blocks below the line.

    Attributes
    ----------
    summary : str
        Text of the line.
    blocks : sequence of Templated
        Content below the line.
    opened : bool
        Whether it is open at first.

    """

    template: ClassVar[str] = 'fold.html'

    summary: str
    blocks: Sequence[Templated]
    opened: bool = False


@dataclass(frozen=True)
class Panels(Templated):
    """
    Groups of blocks side by side, each with a heading.

    Attributes
    ----------
    panels : sequence of (str, str, sequence of Templated)
        Heading, small print next to it, and content.
    three : bool
        Whether three panels are in a row, and not two.

    """

    template: ClassVar[str] = 'panels.html'

    panels: Sequence[tuple[str, str, Sequence[Templated]]]
    three: bool = False


@dataclass(frozen=True)
class Legend(Templated):
    """
    Legend of a chart: colours and their meaning.

    Attributes
    ----------
    roles : sequence of (str, str)
        Role of a series, or 'tick' for the mark of a reference, and its meaning.

    """

    template: ClassVar[str] = 'legend.html'

    roles: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class SmallMultiples(Templated):
    """
    Grid of small pictures, with as many in a row as fit on the page.

    Attributes
    ----------
    figures : sequence of (str, str, Markup, str)
        Caption, small print next to it, picture, and 'heat', 'changed' or ''.

    """

    template: ClassVar[str] = 'small_multiples.html'

    figures: Sequence[tuple[str, str, Markup, str]]


@dataclass(frozen=True)
class Bar:
    """
    Bar of a bar chart, with its text.

    Attributes
    ----------
    value : float
        Length, in the unit of all bars; not negative.
    role : str
        Role of the series, which gives the colour.
    text : str
        Text next to the bar.

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
        Legend: role and meaning.
    full : float
        Value of a bar over the full width; 0: the largest value.

    """

    template: ClassVar[str] = 'bars.html'

    rows: Sequence[tuple[str, Sequence[Bar]]]
    roles: Sequence[tuple[Role, str]] = ()
    full: float = 0.0

    def percent(self, bar: Bar) -> float:
        """Return the length of a bar as a percentage of the full width."""
        longest = self.full or max(other.value for _, bars in self.rows for other in bars)
        return round(100.0 * bar.value / longest, 2) if longest > 0.0 else 0.0


@dataclass(frozen=True)
class VerdictSection(Templated):
    """
    Verdict box at the top of a page: verdict, findings, next step, bars, limitations.

    Attributes
    ----------
    grade : str
        One word, shown as a badge; empty for none.
    tone : {'good', 'fair', 'bad', ''}
        Colour of the badge.
    sentences : sequence of str
        Findings; the first one is emphasised.
    beware : sequence of str
        Limitations.
    bars : BarChart or None
        Error or share of each joint or cause.
    step : str
        Next step; may be empty.
    command : str
        Next command after that step; may be empty.

    """

    template: ClassVar[str] = 'verdict.html'

    grade: str
    tone: str
    sentences: Sequence[str]
    beware: Sequence[str] = ()
    bars: BarChart | None = None
    step: str = ''
    command: str = ''


def next_steps(steps: Sequence[str]) -> list[Section]:
    """Return the section with the next steps; [] for one step, which the verdict box shows."""
    bullets = BulletList([(step, '') for step in steps], True)
    return [Section('What to do next', [bullets])] if steps[1:] else []
