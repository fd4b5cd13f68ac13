# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation page of all examples, generated from their files."""

from __future__ import annotations

import ast
from pathlib import Path
import re


def examples_page(folder: Path) -> str:
    """Return a Markdown page with purpose and code of each example."""
    lines = [
        '# Examples',
        '',
        'Each example is a complete program for one job: `python examples/own_urdf.py`. The tests '
        'run all examples.',
        '',
    ]
    for path in sorted(folder.glob('*.py')):
        source = path.read_text(encoding='utf-8')
        title = ast.get_docstring(ast.parse(source)) or path.stem
        code = re.sub(r'\A(#.*\n)+', '', source).rstrip()
        lines += [f'## {path.stem}', '', title, '', '```python', code, '```', '']
    return '\n'.join(lines)
