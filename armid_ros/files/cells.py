# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names that may hold any character, as cells of a CSV table and in lists of an option."""

from __future__ import annotations

import re

#: What begins a formula in a spreadsheet or a comment in our tables; an apostrophe guards it.
_GUARDED = ('=', '+', '-', '@', '#', '\t', '\r', "'")


def csv_cell(name: str) -> str:
    """Return a name as a cell: an apostrophe before what would be a formula, quotes as needed."""
    text = f"'{name}" if name.startswith(_GUARDED) else name
    if any(char in text for char in ',"\r\n'):
        text = '"' + text.replace('"', '""') + '"'
    return text


def parted(text: str, separator: str = ',') -> list[str]:
    """Split a text at a separator, except within double quotes, which stay."""
    parts, last = [], 0
    for match in re.finditer(rf'"[^"]*"|{re.escape(separator)}', text):
        if match[0] == separator:
            parts.append(text[last : match.start()])
            last = match.end()
    return [*parts, text[last:]]


def listed(text: str, separator: str = ',') -> tuple[str, ...]:
    """Return the names of a list; one that has the separator is in double quotes."""
    return tuple(part.replace('"', '') for part in parted(text, separator))
