# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How results show themselves: ten lines in a terminal, a table in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
import textwrap

#: Lines of a result in a terminal.
LINES = 10
WIDTH = 80


@dataclass(frozen=True)
class Summary:
    """
    A result in short.

    Attributes
    ----------
    title : str
        What it is, with the number that matters most.
    badge : str
        One word; empty for none.
    heads : sequence of str
        Of the columns.
    rows : sequence of sequence of str
        Cells; the first is a name.
    bars : sequence of float
        A share from 0 to 1 for each row, drawn in a notebook; empty for none.
    lines : sequence of str
        What stands below.
    details : str
        HTML that a notebook shows folded.

    """

    title: str
    badge: str = ''
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    bars: Sequence[float] = ()
    lines: Sequence[str] = ()
    details: str = field(default='', repr=False)

    def text(self) -> str:
        """Return at most ten lines of 80 columns."""
        badge = f'{self.badge.upper()}: ' if self.badge else ''
        title = textwrap.wrap(badge + self.title, WIDTH, max_lines=3)
        below = [piece for line in self.lines for piece in textwrap.wrap(line, WIDTH)][:2]
        room = LINES - len(title) - len(below) - (1 if self.heads else 0)
        rows = list(self.rows)
        if len(rows) > room:
            left = len(rows) - room + 1
            rows = [*rows[: room - 1], (f'... and {left} more',)]
        return '\n'.join([*title, *_aligned(self.heads, rows), *below])

    def html(self) -> str:
        """Return the same for a notebook."""
        parts = ['<div style="font-family:system-ui,sans-serif;max-width:62em">', '<p><b>']
        if self.badge:
            parts.append(
                '<span style="border:1px solid currentColor;border-radius:1em;'
                f'padding:0 .6em;margin-right:.5em">{escape(self.badge)}</span>'
            )
        parts.append(f'{escape(self.title)}</b></p>')
        if self.rows:
            parts.append(self._html_table())
        parts += [f'<p>{escape(line)}</p>' for line in self.lines]
        return ''.join([*parts, self.details, '</div>'])

    def _html_table(self) -> str:
        return html_table(self.heads, self.rows, self.bars)


class Shown(ABC):
    """A result that prints as its summary."""

    @abstractmethod
    def summary(self) -> Summary:
        """Return the result in short."""

    def __repr__(self) -> str:
        """Return at most ten lines."""
        return self.summary().text()

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return self.summary().html()


def html_table(
    heads: Sequence[str], rows: Sequence[Sequence[str]], bars: Sequence[float] = ()
) -> str:
    """Return a table in HTML, with a bar behind each row where shares are given."""
    cells = [f'<th style="text-align:left">{escape(head)}</th>' for head in heads]
    lines = ['<table><thead><tr>', *cells, '</tr></thead><tbody>']
    for number, row in enumerate(rows):
        lines.append('<tr>')
        lines += [f'<td style="text-align:left">{escape(cell)}</td>' for cell in row]
        if bars:
            width = 100.0 * min(max(bars[number], 0.0), 1.0)
            lines.append(
                '<td style="min-width:10em"><div style="background:#0072b2;height:.7em;'
                f'width:{width:.0f}%"></div></td>'
            )
        lines.append('</tr>')
    return ''.join([*lines, '</tbody></table>'])


def _aligned(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return lines with columns below each other, names to the left and the rest to the right."""
    if not heads:
        return []
    table = [tuple(heads), *(tuple(row) for row in rows)]
    full = [row for row in table if len(row) == len(heads)]
    widths = [max(len(row[k]) for row in full) for k in range(len(heads))]
    spare = WIDTH - sum(widths) - 2 * len(widths)
    widths[0] = max(8, widths[0] + min(0, spare))
    lines = []
    for row in table:
        first = row[0] if len(row) == 1 else _fitted(row[0], widths[0])
        rest = (cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=False))
        lines.append('  '.join(['', first, *rest]).rstrip()[:WIDTH])
    return lines


def _fitted(text: str, width: int) -> str:
    return text.ljust(width) if len(text) <= width else text[: width - 1] + '…'
