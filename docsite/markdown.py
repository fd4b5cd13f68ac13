# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Markdown of table cells, paragraphs and tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
import inspect

_ESCAPES = str.maketrans({'|': '\\|', '<': '&lt;', '>': '&gt;', '*': '\\*', '_': '\\_'})


def cell(text: str) -> str:
    """Return a text as a table cell, with special characters escaped."""
    return ' '.join(text.split()).translate(_ESCAPES)


def prose(text: str) -> str:
    """Return a docstring as paragraphs, with escaped angle brackets."""
    return inspect.cleandoc(text).replace('<', '&lt;')


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a Markdown table, and a blank line; cells are Markdown."""
    yield f'| {" | ".join(heads)} |'
    yield '|' + '---|' * len(heads)
    for row in rows:
        yield f'| {" | ".join(row)} |'
    yield ''
