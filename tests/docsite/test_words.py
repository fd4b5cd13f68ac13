# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Texts that users read have no refused words, and the code has no more of them than before."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[2]
#: Largest number of uses of each refused word in the package; numbers may only fall.
CEILING = {
    'told': 15,
    'said': 74,
    'says': 0,
    'tells': 0,
    'asks': 0,
    'asked': 69,
    'believes': 0,
    'believed': 11,
    'beside': 24,
    'knows': 0,
    'heard': 5,
}
#: Words that messages, help, headings, pages and examples must not have: verbs of speech for
#: computations.
REFUSED = re.compile(
    r'\b(told|said|says|asks|asked|believe[sd]|denie[sd]|beside|knows|heard)\b', re.IGNORECASE
)


@cache
def counts(folder, ending):
    """Count each word in the files of a folder."""
    words = Counter()
    for path in (ROOT / folder).rglob(ending):
        words.update(re.findall(r'\w+', path.read_text(encoding='utf-8')))
    return words


def messages(path):
    """Yield line and text of strings that users can read: all but docstrings and names."""
    tree = ast.parse(path.read_text(encoding='utf-8'))
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    nodes = [node for node in ast.walk(tree) if isinstance(node, documented) and node.body]
    docstrings = {id(node.body[0].value) for node in nodes if isinstance(node.body[0], ast.Expr)}
    commands = [node for node in nodes if any(map(_commands, getattr(node, 'decorator_list', ())))]
    helps = {id(node.body[0].value) for node in commands}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and ' ' in node.value:
            if id(node) not in docstrings or id(node) in helps:
                yield node.lineno, node.value


def _commands(decorator):
    return '.command(' in ast.unparse(decorator) or '.group(' in ast.unparse(decorator)


@pytest.mark.parametrize('word', CEILING)
def test_a_word_of_dialect_becomes_no_more_frequent(word):
    use = f'{word}: docs/reference/glossary.md has the words to use'
    assert counts('armid_ros', '*.py')[word] <= CEILING[word], use


def test_messages_help_and_headings_have_no_dialect():
    package = (ROOT / 'armid_ros').rglob('*.py')
    found = [
        (path.relative_to(ROOT).as_posix(), line, text)
        for path in package
        for line, text in messages(path)
        if REFUSED.search(text)
    ]
    assert found == []


@pytest.mark.parametrize(
    'path',
    [
        *(ROOT / 'docs').rglob('*.md'),
        ROOT / 'README.md',
        *(ROOT / 'armid_ros').rglob('*.html'),
        *(ROOT / 'examples').rglob('*.py'),
    ],
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_pages_have_no_dialect(path):
    text = path.read_text(encoding='utf-8')
    assert [match.group() for match in REFUSED.finditer(text)] == []


def test_glossary_and_documentation_stay_short():
    text = (ROOT / 'docs' / 'reference' / 'glossary.md').read_text(encoding='utf-8')
    assert len(re.findall(r'^: {3}', text, re.MULTILINE)) <= 45
    pages = (ROOT / 'docs').rglob('*.md')
    assert sum(len(page.read_text(encoding='utf-8').split()) for page in pages) <= 20_000
