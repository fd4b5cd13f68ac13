# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names with any characters in the cells of a CSV table and in lists of command options."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import re

#: First characters of formulas and comments; such a cell gets an apostrophe as prefix.
_GUARDED = ('=', '+', '-', '@', '#', '\t', '\r', "'")


def csv_text(rows: Iterable[Sequence[str]]) -> str:
    """
    Format rows as CSV text; the first cell of each row is a name, which is quoted if needed.

    A name that begins like a formula of a spreadsheet gets an apostrophe as prefix. Quotes are
    added if needed.

    """
    lines = []
    for name, *cells in rows:
        text = f"'{name}" if name.startswith(_GUARDED) else name
        if any(char in text for char in ',"\r\n'):
            text = '"' + text.replace('"', '""') + '"'
        lines.append(','.join([text, *cells]) + '\n')
    return ''.join(lines)


def parted(text: str, separator: str = ',') -> list[str]:
    """Split a text at separators that are outside double quotes; quotes are kept."""
    parts, last = [], 0
    for match in re.finditer(rf'"[^"]*"|{re.escape(separator)}', text):
        if match[0] == separator:
            parts.append(text[last : match.start()])
            last = match.end()
    return [*parts, text[last:]]


def listed(text: str, separator: str = ',') -> tuple[str, ...]:
    """Split a separated list into names; a name in double quotes may contain the separator."""
    return tuple(part.replace('"', '') for part in parted(text, separator))
