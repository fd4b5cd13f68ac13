# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Parsing of YAML and JSON documents with untrusted content.

Documents that are deeper or larger than those of this package are rejected before they are built.
Errors of a parser become one error of this package with the name of the file.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import csv
import math
from pathlib import Path
import struct
from typing import Any

from armid_ros.errors import ArmidError
import yaml

#: Largest allowed number in a document; the product of three such numbers is still finite.
LARGEST = 1e100

# The C parser, if installed, is ten times as fast.
_Loader: Any = type('_Loader', (getattr(yaml, 'CSafeLoader', yaml.SafeLoader),), {})
# Angles of joint_limits.yaml, such as '!degrees 90'.
for _unit, _factor in (('!degrees', math.pi / 180.0), ('!radians', 1.0)):
    _Loader.add_constructor(
        _unit, lambda loader, node, factor=_factor: factor * float(loader.construct_scalar(node))
    )
#: Exceptions that unexpected content of a document can cause.
_UNEXPECTED = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    RecursionError,
    TypeError,
    ValueError,
    csv.Error,
    struct.error,
    yaml.YAMLError,
)


@contextmanager
def reading(path: str | Path, error: type[ArmidError]) -> Iterator[None]:
    """
    Convert each parser error in a `with` block into an error that names the file.

    Parameters
    ----------
    path : str or Path
        The file, for the message.
    error : type of ArmidError
        Class of the raised error.

    Raises
    ------
    ArmidError
        For any error caused by the content; the message begins with the path.

    """
    try:
        yield
    except ArmidError as problem:
        if str(problem).startswith(f'{path}:'):
            raise
        raise error(f'{path}: {problem}') from problem
    except _UNEXPECTED as problem:
        raise error(f'{path}: {_error_message(problem)}') from problem


def finite(value: Any, quantity: str) -> float:
    """Convert a value to a float; ValueError if it is not finite, or is larger than LARGEST."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f'{quantity} has to be a finite number, not {str(value)[:40]!r}')
    if abs(number) > LARGEST:
        raise ValueError(f'{quantity} is {number:g}, but has to be at most {LARGEST:g}')
    return number


def load_yaml(text: str) -> Any:
    """
    Parse YAML text to dictionaries, lists, texts and numbers, with limited depth and size.

    Raises
    ------
    ValueError or yaml.YAMLError
        If the text is not YAML, is nested too deep, or has too many nodes with aliases expanded.

    """
    most_levels = 64  # documents of this package have six at most
    most_nodes = 2_000_000  # with aliases expanded; a model of 1,000 joints has 200,000
    open_nodes: list[tuple[str | None, int]] = []
    sizes: dict[str | None, int] = {}  # of nodes with an anchor
    total = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise ValueError(f"line {_line(event)}: the alias '{event.anchor}' has no anchor")
            total += sizes[event.anchor]
        elif isinstance(event, (yaml.SequenceStartEvent, yaml.MappingStartEvent)):
            total += 1
            open_nodes.append((event.anchor, total))
            if len(open_nodes) > most_levels:
                raise ValueError(
                    f'line {_line(event)}: the document is nested more than {most_levels} levels '
                    'deep'
                )
        elif isinstance(event, (yaml.SequenceEndEvent, yaml.MappingEndEvent)):
            anchor, begin = open_nodes.pop()
            sizes[anchor] = total - begin + 1
        elif isinstance(event, yaml.ScalarEvent):
            total += 1
            sizes[event.anchor] = 1
        if total > most_nodes:
            raise ValueError(
                f'line {_line(event)}: the document has more than {most_nodes} nodes with aliases '
                'expanded'
            )
    return yaml.load(text, Loader=_Loader)


def yaml_line(text: str, place: Sequence[str | int]) -> int:
    """
    Return the line number (from 1) of an entry in a YAML text.

    Parameters
    ----------
    text : str
        Text that `load_yaml` can parse.
    place : sequence of str or int
        Keys and indices that lead to the entry; if they lead to nothing, the line is that of the
        last existing entry.

    """
    node: Any = yaml.compose(text, Loader=_Loader)
    mark = node.start_mark
    for part in place:
        if isinstance(node, yaml.MappingNode):
            pairs = {key.value: (key, value) for key, value in node.value}
        elif isinstance(node, yaml.SequenceNode):
            pairs = {k: (value, value) for k, value in enumerate(node.value)}
        else:
            break
        if part not in pairs:
            break
        key, node = pairs[part]
        mark = key.start_mark
    return int(mark.line) + 1


def _line(event: yaml.Event) -> int:
    """Return the line number (from 1) of a parser event; 0 if unknown."""
    return 0 if event.start_mark is None else int(event.start_mark.line) + 1


def _error_message(problem: BaseException) -> str:
    """Return the message of a parser error as one line."""
    if isinstance(problem, RecursionError):
        return 'the document is nested too deep'
    if isinstance(problem, MemoryError):
        return 'the document is too large for the memory'
    if isinstance(problem, KeyError) and problem.args:
        return f"the key '{problem.args[0]}' is missing"
    text = ' '.join(str(problem).split())
    if isinstance(problem, yaml.YAMLError):
        return f'not YAML: {text}'
    name = '' if isinstance(problem, ValueError) else type(problem).__name__
    return ': '.join(filter(None, (name, text))) or type(problem).__name__
