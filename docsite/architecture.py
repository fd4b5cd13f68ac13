# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation page with a diagram of the function calls of each job."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
import re

#: The command of each job, by its module and name.
JOBS = {
    'identify': ('armid_ros.cli.identify', 'identify'),
    'diagnose': ('armid_ros.cli.diagnose', 'diagnose'),
    'excite': ('armid_ros.cli.excite', 'excite'),
    'compare': ('armid_ros.cli.compare', 'compare'),
}
#: Functions whose calls are listed as well: the workflow of a job, and the function of the same
#: name.
_OPENED = re.compile(r'api\.(?!arguments|table)|identification\.identify|diagnosis\.diagnose')
#: Functions that every job uses, and those that print results.
_EVERYWHERE = re.compile(
    r'errors|motion|files|estimate|cli|api\.(arguments|table)|recording\.(curves|twice)'
    r'|report\.(notation|families|judgement|compare_report)'
)
#: Height of a row, distance of two lanes, width of a name, and width of the text [px].
_ROW, _LANE, _NAME, _TEXT = 18, 22, 240, 560
_BEGINNING = """# Architecture

Each diagram shows the function calls of one armid command, from top to bottom. Each vertical lane
stands for a room, which is a folder of the package. The dot of a function lies in the lane of its
room; a line connects the function to its caller. The text to the right of a function is the first
line of its docstring. Each function is shown once; private functions and functions that only check
their arguments (`require_...`) are left out.
"""


@dataclass(frozen=True)
class Step:
    """A function call of a diagram: depth, room, function name, first line of the docstring."""

    depth: int
    room: str
    name: str
    summary: str


@dataclass(frozen=True)
class Module:
    """A parsed module: functions and classes by name, and the origins of imported names."""

    defined: dict[str, ast.stmt]
    imported: dict[str, tuple[str, str]]


@cache
def module(package: Path, dotted: str) -> Module | None:
    """Parse a module or subpackage by its dotted name; return None if the file does not exist."""
    place = package.parent.joinpath(*dotted.split('.'))
    path = place / '__init__.py' if place.is_dir() else place.with_suffix('.py')
    if not path.is_file():
        return None
    tree = ast.parse(path.read_text(encoding='utf-8'))
    kinds = ast.FunctionDef | ast.ClassDef
    imported = {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or '').startswith('armid_ros')
        for alias in node.names
    }
    return Module({one.name: one for one in tree.body if isinstance(one, kinds)}, imported)


def found(package: Path, dotted: str, name: str) -> tuple[str, str] | None:
    """Return module and name where a name is defined, through re-exports; None if nowhere."""
    here = module(package, dotted)
    if here is None:
        return None
    if name in here.defined:
        return dotted, name
    return found(package, *here.imported[name]) if name in here.imported else None


def calls(body: ast.AST) -> Iterator[str]:
    """Yield the names of called functions; a call within an argument precedes the outer call."""
    for child in ast.iter_child_nodes(body):
        yield from calls(child)
    if isinstance(body, ast.Call):
        called = body.func.value if isinstance(body.func, ast.Attribute) else body.func
        if isinstance(called, ast.Name):
            yield called.id


def steps(package: Path, dotted: str, name: str) -> list[Step]:
    """Return the calls between rooms to which a function leads, each call once, in order."""
    seen: set[tuple[str, str]] = set()

    def follow(dotted: str, own: str, depth: int) -> Iterator[Step]:
        here = module(package, dotted)
        assert here is not None
        function = ast.Module([*getattr(here.defined[own], 'body', [])], [])
        for called in calls(function):
            place = found(package, dotted, called)
            if place is None or place in seen:
                continue
            seen.add(place)
            room = place[0].removeprefix('armid_ros.')
            if place[0] == dotted and called.startswith('_'):
                yield from follow(*place, depth)
            elif not _EVERYWHERE.match(room) and not called.startswith(('_', 'require_')):
                theirs = module(package, place[0])
                assert theirs is not None
                text = ast.get_docstring(theirs.defined[place[1]]) or ''
                summary = ' '.join(text.partition('\n\n')[0].split())
                yield Step(depth, room.partition('.')[0], place[1], summary)
                if _OPENED.match(room) and place[1] not in JOBS.keys() - {name}:
                    yield from follow(*place, depth + 1)

    return list(follow(dotted, name, 1))


def diagram(job: str, calls_of_job: list[Step]) -> Iterator[str]:
    """Yield the lines of an SVG image with a lane for each room and a row for each call."""
    rows = [Step(0, 'cli', job, f'The command armid {job}.'), *calls_of_job]
    rooms = list(dict.fromkeys(('cli', 'api', *(one.room for one in rows))))
    lane = {room: 8 + _LANE * k for k, room in enumerate(rooms)}
    names, top = 12 + _LANE * len(rooms), 78
    texts = names + _NAME
    width, height = texts + _TEXT, top + _ROW * len(rows)
    yield (
        f'<div class="diagram"><svg viewBox="0 0 {width} {height}" width="{width}" role="img" '
        f'aria-label="Calls of armid {job} from room to room">'
    )
    for room, x in lane.items():
        turned = f'translate({x + 4} {top - 14}) rotate(-40)'
        yield f'<text class="room" transform="{turned}">{room}</text>'
        yield f'<path class="lane" d="M{x} {top - 10}V{height - 4}"/>'
    last: list[tuple[int, int]] = []
    for k, one in enumerate(rows):
        x, y = lane[one.room], top + _ROW * k
        last = last[: one.depth]
        if last:
            yield f'<path class="call" d="M{last[-1][0]} {last[-1][1]}V{y}H{x}"/>'
        last.append((x, y))
        yield f'<circle cx="{x}" cy="{y}" r="4"/>'
        yield f'<text class="name" x="{names + 10 * one.depth}" y="{y + 4}">{one.name}</text>'
        yield f'<text x="{texts}" y="{y + 4}">{escape(one.summary)}</text>'
    yield '</svg></div>'
    yield ''


def architecture_page(package: Path) -> str:
    """Return a Markdown page with a diagram of function calls for each command."""
    lines = [_BEGINNING]
    for job, (dotted, name) in JOBS.items():
        lines += [f'## {job}', '', *diagram(job, steps(package, dotted, name))]
    return '\n'.join(lines)
