# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Pieces of Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import inspect

_ESCAPES = str.maketrans({'|': '\\|', '<': '&lt;', '>': '&gt;', '*': '\\*', '_': '\\_'})


def cell(text: str) -> str:
    """Return a text as it stands in a table, whatever characters it has."""
    return ' '.join(text.split()).translate(_ESCAPES)


def prose(text: str) -> str:
    """Return a docstring as paragraphs, in which no angle bracket is a tag."""
    return inspect.cleandoc(text).replace('<', '&lt;')


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Return the lines of a table, with a blank one below; cells are Markdown."""
    yield f'| {" | ".join(heads)} |'
    yield '|' + '---|' * len(heads)
    for row in rows:
        yield f'| {" | ".join(row)} |'
    yield ''
