# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation page of all numbers in the code of the diagnosis."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import fields
import inspect
from pathlib import Path
import re

from armid_ros.diagnosis.settings import Thresholds

from docsite.markdown import cell, table

_ENTRY = re.compile(r'^(?P<names>\w+(?:, \w+)*) : (?P<type>.+)$')


def numbers_page(package: Path) -> str:
    """Return a Markdown page of the numbers that the modules of a folder define or import."""
    meaning = _meanings(inspect.cleandoc(Thresholds.__doc__ or ''))
    rows = [
        (f'`{field.name}`', f'{field.default:g}', cell(meaning.get(field.name, '')))
        for field in fields(Thresholds)
        if isinstance(field.default, int | float)
    ]
    others = [
        (f'`{name}`', cell(value), cell(why), f'`{path}`')
        for path, name, value, why in _others(package)
    ]
    return '\n'.join(
        [
            '# Numbers of the diagnosis',
            '',
            'This page lists every number in the code of the diagnosis.',
            '',
            f'## {len(rows)} numbers that decide which effect is named',
            '',
            'A share is a part of the gap of held-out data.',
            '',
            *table(('number', 'value', 'meaning'), rows),
            '',
            f'## {len(others)} numbers of data, numerics and messages',
            '',
            'These numbers select rows, recognise faults of data, set the steps of searches, and '
            'choose the words of messages.',
            '',
            *table(('number', 'value', 'meaning and reason', 'file'), others),
            '',
        ]
    )


def _others(package: Path) -> Iterator[tuple[str, str, str, str]]:
    """Yield file, name, value and comment of every numeric constant, imported ones included."""
    wanted: dict[str, set[str]] = {}
    for path in sorted(package.rglob('*.py')):
        text = path.read_text(encoding='utf-8')
        for name, value, why in constants(text):
            yield path.relative_to(package).as_posix(), name, value, why
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module:
                wanted.setdefault(node.module, set()).update(alias.name for alias in node.names)
    root = package.parents[1]
    for module, names in sorted(wanted.items()):
        path = root.joinpath(*module.split('.')).with_suffix('.py')
        if path.is_file() and package not in path.parents:
            for name, value, why in constants(path.read_text(encoding='utf-8')):
                if name in names:
                    yield path.relative_to(root).as_posix(), name, value, why


def _meanings(docstring: str) -> dict[str, str]:
    """Return the descriptions of a docstring's attributes, by name."""
    found: dict[str, str] = {}
    names: list[str] = []
    for line in docstring.splitlines():
        entry = _ENTRY.match(line)
        if entry:
            names = entry['names'].split(', ')
            found.update(dict.fromkeys(names, ''))
        elif names and line.startswith('    '):
            found.update({name: f'{found[name]} {line.strip()}'.strip() for name in names})
    return found


def constants(source: str) -> Iterator[tuple[str, str, str]]:
    """Yield name, value and preceding comment of every numeric constant of a module."""
    lines = source.splitlines()
    for node in ast.parse(source).body:
        if not isinstance(node, ast.Assign) or not _is_numbers(node.value):
            continue
        above, first = [], node.lineno - 2
        while first >= 0 and lines[first].startswith('#:'):
            above.insert(0, lines[first].removeprefix('#:').strip())
            first -= 1
        yield ast.unparse(node.targets[0]).strip('()'), ast.unparse(node.value), ' '.join(above)


def _is_numbers(node: ast.expr) -> bool:
    if isinstance(node, ast.Tuple):
        return all(map(_is_numbers, node.elts))
    if isinstance(node, ast.UnaryOp):
        return _is_numbers(node.operand)
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float)
