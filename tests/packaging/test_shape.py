# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Functions and folders keep their limits of size, and names have one meaning."""

import ast
from collections import Counter, defaultdict
import json
from pathlib import Path

import pytest

MOST_LINES, MOST_PARAMETERS, MOST_OF_FILE, MOST_IN_ROOM = 60, 8, 450, 28
#: Functions that exceed a limit; none may be added.
LONG: set[str] = set()
MANY = {
    'api/arguments.py:read_recording',  # each option of a user is a parameter
    'api/diagnosis.py:diagnose',
    'api/design.py:design_excitation',
    'api/identification.py:identify',
    'diagnosis/diagnose.py:diagnose',  # each input of a user is a parameter
}

#: Largest number of lines of each room of the package. A budget is at most `SLACK` above the
#: present number, and is raised only by the length of new code.
BUDGETS = json.loads(Path(__file__).with_name('budgets.json').read_text('utf-8'))
SLACK = 1.02


@pytest.fixture(scope='module')
def trees(root):
    """Return the syntax tree of every module of the package, by path."""
    package = root / 'armid_ros'
    return {
        path.relative_to(package).as_posix(): ast.parse(path.read_text('utf-8'))
        for path in package.rglob('*.py')
    }


def functions(trees):
    """Yield every function of the package with its file and name."""
    for place, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield f'{place}:{node.name}', node


def is_command(function):
    """Return whether the parameters of a function are options of a command."""
    return any('.command(' in ast.unparse(one) for one in function.decorator_list)


def lines_of(function):
    """Count the lines of a function without docstring, and without the imports of a command."""
    count = function.end_lineno - function.lineno + 1
    left_out = function.body[:1] if ast.get_docstring(function) else []
    if is_command(function):
        left_out += [one for one in function.body if isinstance(one, ast.ImportFrom | ast.Import)]
        count -= len(parameters_of(function))
    return count - sum(one.end_lineno - one.lineno + 1 for one in left_out)


def parameters_of(function):
    """Return the parameter names of a function without self and cls."""
    given = function.args
    names = [one.arg for one in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return names[1:] if names[:1] in (['self'], ['cls']) else names


def test_no_file_is_longer_than_can_be_read_at_once(root):
    files = list((root / 'armid_ros').rglob('*.py'))
    assert len(files) > 100
    lines = {str(path): path.read_text('utf-8').count('\n') for path in files}
    assert {name: count for name, count in lines.items() if count > MOST_OF_FILE} == {}


def lines_by_room(root):
    """Count the lines of every room of the package, of the tests and of the benchmarks."""
    lines = Counter()
    for folder in ('armid_ros', 'tests', 'benchmarks'):
        for path in (root / folder).rglob('*.py'):
            place = path.relative_to(root)
            rooms = place.parts[: 2 if folder == 'armid_ros' and len(place.parts) > 2 else 1]
            lines['/'.join(rooms)] += path.read_text('utf-8').count('\n')
    return lines


def test_every_room_keeps_its_budget(root):
    lines = lines_by_room(root)
    assert {room: n for room, n in lines.items() if n > BUDGETS.get(room, 0)} == {}
    assert {room: n for room, n in BUDGETS.items() if n > SLACK * lines[room] + 20} == {}


def test_no_room_has_more_files_than_can_be_seen_at_once(root):
    package = root / 'armid_ros'
    rooms = {str(path): len(list(path.glob('*.py'))) for path in package.rglob('*/')}
    assert len(rooms) > 20
    assert {room: count for room, count in rooms.items() if count > MOST_IN_ROOM} == {}


def test_no_function_is_longer_than_a_screen(trees):
    found = {place for place, one in functions(trees) if lines_of(one) > MOST_LINES}
    assert found <= LONG


def test_no_function_takes_more_parameters_than_can_be_remembered(trees):
    found = {
        place
        for place, one in functions(trees)
        if len(parameters_of(one)) > MOST_PARAMETERS and not is_command(one)
    }
    assert found <= MANY


def test_a_public_class_has_its_name_alone(trees):
    places = defaultdict(set)
    for place, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith('_'):
                places[node.name].add(place)
    assert {name: sorted(where) for name, where in places.items() if len(where) > 1} == {}
