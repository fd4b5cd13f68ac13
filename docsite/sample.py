# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A sample of docstrings, messages and sentences, for a reader who did not write them.

``python -m docsite.sample [--seed 0] [--count 100]`` prints docstrings, messages and sentences
of pages in equal numbers. The reader marks each item: clear, clear on second reading, or unclear.

"""

from __future__ import annotations

import argparse
import ast
from collections.abc import Iterator
from pathlib import Path
import re

import numpy as np

ROOT = Path(__file__).parents[1]
_SENTENCE = re.compile(r'(?<=[.!?]) +(?=[A-Z`[])')
#: Fewest words of a message.
_FEWEST = 4


def docstrings(package: Path) -> Iterator[tuple[str, str]]:
    """Yield file and signature of functions and classes, and the summary of their docstrings."""
    for path in sorted(package.rglob('*.py')):
        for name, node in _definitions(ast.parse(path.read_text('utf-8'))):
            text = (ast.get_docstring(node) or '').partition('\n\n')[0]
            if text:
                place = path.relative_to(package).as_posix()
                yield f'{place}: {_signature(name, node)}', ' '.join(text.split())


def _definitions(
    parent: ast.AST, prefix: str = ''
) -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    """Yield the functions and classes in a node, with their qualified names."""
    for node in ast.iter_child_nodes(parent):
        name = prefix
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            name = f'{prefix}{node.name}.'
            yield name[:-1], node
        yield from _definitions(node, name)


def _signature(name: str, node: ast.FunctionDef | ast.ClassDef) -> str:
    """Return a name with the signature that ``help()`` shows; a property has none."""
    if isinstance(node, ast.ClassDef):
        return f'class {name}'
    if any('property' in ast.unparse(one) for one in node.decorator_list):
        return name
    returned = f' -> {ast.unparse(node.returns)}' if node.returns else ''
    return f'{name}({ast.unparse(node.args)}){returned}'


def messages(package: Path) -> Iterator[tuple[str, str]]:
    """Yield file and line of each raised error, and its message with values in braces."""
    for path in sorted(package.rglob('*.py')):
        for node in ast.walk(ast.parse(path.read_text('utf-8'))):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                for given in node.exc.args:
                    if isinstance(given, ast.JoinedStr | ast.Constant):
                        text = ast.unparse(given).lstrip('f').strip('\'"')
                        if len(text.split()) >= _FEWEST:
                            yield f'{path.relative_to(package).as_posix()}:{node.lineno}', text


def sentences(pages: Path) -> Iterator[tuple[str, str]]:
    """Yield the sentences of all pages, without code, tables, headings, bullets and directives."""
    for path in sorted(pages.rglob('*.md')):
        text = re.sub(r'^```.*?^```$', '', path.read_text('utf-8'), flags=re.MULTILINE | re.DOTALL)
        for paragraph in re.split(r'\n\s*\n', text):
            if paragraph.strip() and not re.match(r'\s*([#|<!\-]|:::)', paragraph):
                text = re.sub(r'^\d+\. ', '', ' '.join(paragraph.split()))
                for one in _SENTENCE.split(text):
                    yield path.relative_to(pages).as_posix(), one


def drawn(seed: int, count: int) -> list[tuple[str, str]]:
    """Draw docstrings, messages and sentences in equal numbers; return place and text of each."""
    rng = np.random.default_rng(seed)
    package = ROOT / 'armid_ros'
    kinds = [
        list(kind) for kind in (docstrings(package), messages(package), sentences(ROOT / 'docs'))
    ]
    parts = np.array_split(np.arange(count), len(kinds))
    return [
        kind[k]
        for kind, part in zip(kinds, parts, strict=True)
        for k in sorted(rng.choice(len(kind), len(part), replace=False).tolist())
    ]


def main() -> None:
    """Print the drawn items with their numbers and places."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--count', type=int, default=100)
    asked = parser.parse_args()
    for number, (place, text) in enumerate(drawn(asked.seed, asked.count), start=1):
        print(f'{number:3} [{place}]\n    {text}')


if __name__ == '__main__':
    main()
