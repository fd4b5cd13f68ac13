# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Code blocks of pages, and a script that runs the blocks of a page in order.

A block in `bash` or `python` is run. The line above a block that cannot run gives the reason:
``<!-- not run: needs a robot -->``. Printed output and formulas are `text`.

A page finds all files of the desk. A page that makes some of them itself lists in its first line
the files that it needs: ``<!-- starts with: my_arm.urdf -->``.

"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import re

#: Languages of executed blocks.
RUN = ('bash', 'python')
#: All permitted languages of blocks.
LANGUAGES = (*RUN, 'text', 'yaml', 'json', 'xml', 'mermaid')

_FENCE = re.compile(r'^```(\w*)$')
_EXCUSE = re.compile(r'^<!-- not run: (.+) -->$')
_START = re.compile(r'\A<!-- starts with: (.+) -->$', re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """
    A code block of a Markdown page.

    Attributes
    ----------
    line : int
        Number of its first line, from 1.
    language : str
        Language after the opening fence; 'indented' for an indented block.
    text : str
        The code.
    excuse : str
        Reason why the block cannot run; empty if it can.

    """

    line: int
    language: str
    text: str
    excuse: str = ''


def blocks(path: Path) -> tuple[Block, ...]:
    """Return the code blocks of a Markdown page, in their order."""
    lines = path.read_text(encoding='utf-8').splitlines()
    found, k = [], 0
    while k < len(lines):
        fence = _FENCE.match(lines[k])
        if fence:
            end = next((m for m in range(k + 1, len(lines)) if lines[m] == '```'), len(lines))
            excuse = _EXCUSE.match(lines[k - 1]) if k else None
            text = '\n'.join(lines[k + 1 : end])
            found.append(Block(k + 1, fence[1], text, excuse[1] if excuse else ''))
            k = end
        elif lines[k].startswith('    ') and k and not lines[k - 1].strip():
            found.append(Block(k + 1, 'indented', lines[k].strip()))
        k += 1
    return tuple(found)


def starts_with(path: Path) -> tuple[str, ...] | None:
    """Return the files that a page needs, from its first line; None for all example files."""
    listed = _START.search(path.read_text(encoding='utf-8'))
    return None if listed is None else tuple(listed[1].split())


def script(page: tuple[Block, ...]) -> str:
    """Return a shell script that runs the executable blocks of a page, and stops at an error."""
    lines = ['set -eu -o pipefail']
    for block in page:
        if block.language not in RUN or block.excuse:
            continue
        lines.append(f'echo "line {block.line}" >&2')
        if block.language == 'python':
            lines += [f"python - <<'PYTHON_OF_LINE_{block.line}'", block.text]
            lines.append(f'PYTHON_OF_LINE_{block.line}')
        else:
            lines.append(block.text)
    return '\n'.join([*lines, ''])
