# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Tables and small curves of many arms."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import ContentSection, DataTable, Paragraph
from markupsafe import escape, Markup
import numpy as np

#: Size of a small curve, and of a larger one with intervals [px].
_SMALL, _LARGE = (84, 20), (250, 74)


def fleet_table(
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    numbers: Sequence[int] = (),
    hint: str = '',
) -> ContentSection:
    """
    Return a table whose cells may have links and curves.

    Parameters
    ----------
    title : str
        Heading.
    heads : sequence of str
        Heads of the columns.
    rows : sequence of sequence of str
        Cells; those of class Markup are not escaped.
    numbers : sequence of int
        Columns of numbers.
    hint : str
        Text below; empty for none.

    """
    words = [k for k in range(len(heads)) if k not in numbers]
    table = DataTable(heads, rows, words, 'fleet')
    return ContentSection(title, [table, *([Paragraph(hint, 'hint')] if hint else [])])


def link(target: str, text: str) -> Markup:
    """Return a text that leads to a page, or the text alone where there is none."""
    return Markup('<a href="{}">{}</a>').format(target, text) if target else escape(text)


def drawing(
    x: FloatArray,
    values: FloatArray,
    std: FloatArray,
    cut: int = 0,
    links: Sequence[str] = (),
    title: str = '',
) -> tuple[Markup, tuple[float, float]]:
    """
    Draw a series: small as a line, or larger as points with intervals and links.

    Parameters
    ----------
    x : ndarray, shape (K,)
        Abscissae, increasing.
    values, std : ndarray, shape (K,)
        Estimates and their deviations.
    cut : int
        First value after a step; 0 for none.
    links : sequence of str
        Where points lead; none for a line.
    title : str
        Text of the tooltip.

    Returns
    -------
    Markup, tuple of two float
        The drawing, and the ends of its ordinate.

    """
    (width, height), wide = (_LARGE, HALF_WIDTH) if links else (_SMALL, 0.0)
    low, high = float(np.min(values - wide * std)), float(np.max(values + wide * std))
    least = max(6.0 * float(np.median(std)), 1e-3 * float(np.max(np.abs(values))), 1e-12)
    spare = max(0.0, 0.5 * (least - (high - low)))
    low, high = low - spare, high + spare
    across = 4.0 + (width - 8.0) * (x - x[0]) / (float(np.ptp(x)) or 1.0)
    scale = (height - 8.0) / (high - low)
    up = height - 4.0 - scale * (values - low)
    parts = [f'<title>{escape(title)}</title>'] if title else []
    if 0 < cut < len(x):
        at = 0.5 * (across[cut - 1] + across[cut])
        parts.append(f'<line class="cut" x1="{at:.1f}" x2="{at:.1f}" y1="0" y2="{height}"/>')
    for a, b, half, target in zip(across, up, wide * std * scale, links, strict=bool(links)):
        parts.append(
            f'<line class="interval" x1="{a:.1f}" x2="{a:.1f}" '
            f'y1="{b - half:.1f}" y2="{b + half:.1f}"/>'
        )
        parts.append(
            link(target, Markup(f'<circle class="dot" cx="{a:.1f}" cy="{b:.1f}" r="2.6"/>'))
        )
    if not links:
        line = ' '.join(f'{a:.1f},{b:.1f}' for a, b in zip(across, up, strict=True))
        parts.append(f'<polyline class="line" points="{line}"/>')
        parts.append(f'<circle class="dot" cx="{across[-1]:.1f}" cy="{up[-1]:.1f}" r="1.8"/>')
    svg = Markup(
        f'<svg class="spark" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" role="img">{"".join(parts)}</svg>'
    )
    return svg, (low, high)
