# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names as cells of a CSV table, which a spreadsheet must not take for formulas."""

from __future__ import annotations

#: What begins a formula in a spreadsheet or a comment in our tables; an apostrophe guards it.
_GUARDED = ('=', '+', '-', '@', '#', '\t', '\r', "'")


def csv_cell(name: str) -> str:
    """Return a name as a cell: an apostrophe before what would be a formula, quotes as needed."""
    text = f"'{name}" if name.startswith(_GUARDED) else name
    if any(char in text for char in ',"\r\n'):
        text = '"' + text.replace('"', '""') + '"'
    return text


def cell_name(cell: str) -> str:
    """Return the name that a cell holds, its quotes removed by the reader of the table."""
    return cell[1:] if cell.startswith("'") and cell[1:].startswith(_GUARDED) else cell
