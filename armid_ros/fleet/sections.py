# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables and small curves of many arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.motion import FloatArray
from armid_ros.report.page import Section
from markupsafe import escape, Markup
import numpy as np

#: Size of a small curve, and of a larger one with intervals [px].
_SMALL, _LARGE = (84, 20), (250, 74)
#: Half width of a 95 % interval, in standard deviations.
_WIDE = 1.96


@dataclass(frozen=True)
class ArmRow:
    """
    An arm in the overview.

    Attributes
    ----------
    arm, health, what : str
        Its name, a word, and a sentence.
    link, bag_link : str
        Its page, and the bag in question on it; empty for none.
    bags, refused : int
        How many.
    error : str
        Relative error.
    spark : Markup
        Curve of what it is named for; empty for none.
    sparks : sequence of Markup
        Curves of the columns.
    diagnosis, diagnosis_link : str
        What the diagnosis says, and its report; empty for none.

    """

    arm: str
    health: str
    what: str
    link: str
    bag_link: str
    bags: int
    refused: int
    error: str
    spark: Markup
    sparks: Sequence[Markup]
    diagnosis: str = ''
    diagnosis_link: str = ''


@dataclass(frozen=True)
class Arms(Section):
    """
    All arms by their health.

    Attributes
    ----------
    heads : sequence of str
        Parameters that have a column of curves.
    rows : sequence of ArmRow
        Those first that need a person.

    """

    title: ClassVar[str] = 'Arms'
    package: ClassVar[str] = 'armid_ros.fleet'
    template: ClassVar[str] = 'arms.html'

    heads: Sequence[str]
    rows: Sequence[ArmRow]


@dataclass(frozen=True)
class Curve:
    """
    A parameter over time.

    Attributes
    ----------
    title, range : str
        What it is, and from where to where the ordinate goes.
    svg : Markup
        The drawing.
    changed : bool
        Whether it has changed.

    """

    title: str
    range: str
    svg: Markup
    changed: bool = False


@dataclass(frozen=True)
class ParameterCurves(Section):
    """All parameters of an arm over time, those that have changed first."""

    title: ClassVar[str] = 'Parameters over time'
    package: ClassVar[str] = 'armid_ros.fleet'
    template: ClassVar[str] = 'series.html'

    curves: Sequence[Curve]


@dataclass(frozen=True)
class Cell:
    """A text, and where it leads; empty for nowhere."""

    text: str
    link: str = ''


@dataclass(frozen=True)
class TableRow:
    """Cells, and the name of the row within the page; empty for none."""

    cells: Sequence[Cell]
    anchor: str = ''


@dataclass(frozen=True)
class _Table(Section):
    package: ClassVar[str] = 'armid_ros.fleet'
    template: ClassVar[str] = 'table.html'

    heads: Sequence[str]
    rows: Sequence[TableRow]
    numbers: Sequence[int] = ()
    hint: str = ''


class Headline(_Table):
    """What the diagnosis says of an arm."""

    title: ClassVar[str] = 'Diagnosis'


class Bags(_Table):
    """The bags of an arm."""

    title: ClassVar[str] = 'Bags'


class RefusedBags(_Table):
    """Bags that are not used."""

    title: ClassVar[str] = 'Refused bags'


class Wear(_Table):
    """Trends in a month."""

    title: ClassVar[str] = 'Wear'


def spark(values: FloatArray, std: FloatArray, cut: int = 0, title: str = '') -> Markup:
    """
    Draw a series small.

    Parameters
    ----------
    values, std : ndarray, shape (K,)
        Estimates and their deviations.
    cut : int
        First value after a step; 0 for none.
    title : str
        Text of the tooltip.

    """
    width, height = _SMALL
    x, y, _ = _placed(np.arange(len(values), dtype=float), values, std, width, height, 0.0)
    line = ' '.join(f'{a:.1f},{b:.1f}' for a, b in zip(x, y, strict=True))
    parts = [f'<polyline class="line" points="{line}"/>']
    if 0 < cut < len(x):
        at = 0.5 * (x[cut - 1] + x[cut])
        parts.append(f'<line class="cut" x1="{at:.1f}" x2="{at:.1f}" y1="0" y2="{height}"/>')
    parts.append(f'<circle class="dot" cx="{x[-1]:.1f}" cy="{y[-1]:.1f}" r="1.8"/>')
    return _svg(width, height, parts, title)


def curve(
    days: FloatArray, values: FloatArray, std: FloatArray, links: Sequence[str], cut: int = 0
) -> tuple[Markup, tuple[float, float]]:
    """Draw a series with intervals and links; return it, and the ends of its ordinate."""
    width, height = _LARGE
    x, y, ends = _placed(days, values, std, width, height, _WIDE)
    scale = (height - 8.0) / (ends[1] - ends[0])
    parts = []
    if 0 < cut < len(x):
        at = 0.5 * (x[cut - 1] + x[cut])
        parts.append(f'<line class="cut" x1="{at:.1f}" x2="{at:.1f}" y1="0" y2="{height}"/>')
    for a, b, half, link in zip(x, y, _WIDE * std * scale, links, strict=True):
        parts.append(
            f'<line class="interval" x1="{a:.1f}" x2="{a:.1f}" '
            f'y1="{b - half:.1f}" y2="{b + half:.1f}"/>'
        )
        dot = f'<circle class="dot" cx="{a:.1f}" cy="{b:.1f}" r="2.6"/>'
        parts.append(f'<a href="{escape(link)}">{dot}</a>' if link else dot)
    return _svg(width, height, parts), ends


def _placed(
    x: FloatArray, values: FloatArray, std: FloatArray, width: int, height: int, wide: float
) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Return where points are drawn, and the ends of the ordinate."""
    low, high = float(np.min(values - wide * std)), float(np.max(values + wide * std))
    least = max(6.0 * float(np.median(std)), 1e-3 * float(np.max(np.abs(values))), 1e-12)
    spare = max(0.0, 0.5 * (least - (high - low)))
    low, high = low - spare, high + spare
    span = float(np.ptp(x)) or 1.0
    across = 4.0 + (width - 8.0) * (x - x[0]) / span
    up = height - 4.0 - (height - 8.0) * (values - low) / (high - low)
    return across, up, (low, high)


def _svg(width: int, height: int, parts: Sequence[str], title: str = '') -> Markup:
    said = f'<title>{escape(title)}</title>' if title else ''
    return Markup(
        f'<svg class="spark" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" role="img">{said}{"".join(parts)}</svg>'
    )
