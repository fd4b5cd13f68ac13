# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Code outside the room effects names no effect: facts of an effect are in its class."""

import ast
import re

from armid_ros.effects import CATALOGUE
import pytest

#: Files that still name effects, and how often; numbers may fall, and no file may be added.
LEFT = {
    # effects that act on a shipped arm
    'simulation/elastic.py': 7,
    # advice and examples for users
    'papers/elastic/springs.py': 5,
    'identification/known_payload.py': 2,
    'simulation/springs.py': 3,
    # help without an import of effects; a test compares the names with the catalogue
    'cli/choices.py': 5,
    'nodes/running/launching.py': 2,
    # effects that a room makes, or fits to an arm at rest
    'residual/learn.py': 1,
    'zero/fit.py': 25,
    'positions/loop.py': 4,
    'positions/text.py': 1,
    # a key of diagnosis.json with the name of an effect
    'diagnosis/next_run/plan.py': 1,
}


def _docstrings(tree):
    """Return the docstrings of a module, which may name effects as examples."""
    found = set()
    for node in ast.walk(tree):
        body = getattr(node, 'body', None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            found.add(body[0].value)
    return found


def _says(text, name):
    """Count an effect name in a text; names that are English words count only alone."""
    if name not in text:
        return 0
    if '_' in name:
        return len(re.findall(rf'(?<![a-z_]){name}(?![a-z_])', text))
    return int(text == name) + len(re.findall(rf'\b{name}[@:]', text))


def count_names(source):
    """Count the names of effects and imports of their classes in a module."""
    tree = ast.parse(source)
    docstrings = _docstrings(tree)
    classes = {kind.__name__ for kind in CATALOGUE.values()}
    count = 0
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if node not in docstrings:
                count += sum(_says(node.value, name) for name in CATALOGUE)
        elif isinstance(node, ast.ImportFrom) and (node.module or '').startswith(
            'armid_ros.effects'
        ):
            count += sum(alias.name in classes for alias in node.names)
    return count


@pytest.fixture(scope='module')
def counts(root):
    """Return the number of effect names in each file outside the room effects."""
    package = root / 'armid_ros'
    files = [path for path in package.rglob('*.py') if path.parent != package / 'effects']
    assert len(files) > 100
    found = {
        path.relative_to(package).as_posix(): count_names(path.read_text('utf-8'))
        for path in files
    }
    return {path: count for path, count in found.items() if count}


def test_no_file_names_effects_but_those_that_are_known(counts):
    assert counts == LEFT
