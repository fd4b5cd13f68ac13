# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which columns are positions, velocities and efforts, from what they are called.

Columns that are alike but for a joint's name or number form a family; a family is judged by the
words in its name. A guess is always shown, with what else would have fitted.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import re

from armid_ros.recording.tables.patterns import by_number, ChosenColumns, in_order
from armid_ros.recording.tables.settings import renamed
from armid_ros.recording.tables.table import Table, TableColumn
from armid_ros.recording.tables.words import (
    is_quantity,
    MEASURED,
    OTHERWISE,
    QuantityName,
    TIMES,
    WORDS,
    words_of,
)
import numpy as np

_NUMBER = re.compile(r'\d+')


@dataclass(frozen=True)
class Incomplete:
    """
    A family of columns that may be a quantity, but for some joints.

    Attributes
    ----------
    quantity : {'position', 'velocity', 'effort'}
        What it may be.
    pattern : str
        Its columns.
    lacking : tuple of str
        The joints for which there is none, or none with numbers.

    """

    quantity: QuantityName
    pattern: str
    lacking: tuple[str, ...]

    def __str__(self) -> str:
        """Say what is lacking."""
        return f"'{self.pattern}' has no column of numbers for {', '.join(self.lacking)}"


def guess(
    table: Table,
    quantity: QuantityName,
    joints: Sequence[str] | None,
    rename: Sequence[tuple[str, str]] = (),
) -> list[ChosenColumns]:
    """
    Return the families that may be a quantity, the likeliest first.

    Parameters
    ----------
    table : Table
        Where they are.
    quantity : {'position', 'velocity', 'effort'}
        What is looked for.
    joints : sequence of str or None
        The joints, where they are known: a family has to have a column for each.
    rename : sequence of (str, str)
        From names in the file to names of the joints.

    """
    groups = _groups(table, joints, rename).items()
    families = (_in_order(pattern, members, joints, rename) for pattern, members in groups)
    scored = [
        (_score(chosen.pattern, quantity) - _still(chosen), chosen)
        for chosen in families
        if chosen is not None
    ]
    likely = [one for one in scored if one[0] > 0.0]
    best: dict[tuple[TableColumn, ...], ChosenColumns] = {}
    for _, one in sorted(likely, key=lambda one: (-one[0], -len(one[1].columns))):
        best.setdefault(one.columns, one)
    return list(best.values())


def incomplete(
    table: Table,
    quantity: QuantityName,
    joints: Sequence[str],
    rename: Sequence[tuple[str, str]] = (),
) -> Incomplete | None:
    """Return the family that has the most joints by name, where none has all; None without any."""
    best: Incomplete | None = None
    for pattern, members in _groups(table, joints, rename).items():
        names = [renamed(label, rename) for label in members]
        lacking = tuple(joint for joint in joints if joint not in names)
        fewer = len(lacking) < (len(joints) if best is None else len(best.lacking))
        if fewer and _score(pattern, quantity) > 0.0:
            best = Incomplete(quantity, pattern, lacking)
    return best


def guess_time(table: Table) -> TableColumn | None:
    """Return the column of time: named so, and increasing, or else decreasing throughout."""
    return named_time(table, 1.0) or named_time(table, -1.0)


def named_time(table: Table, way: float) -> TableColumn | None:
    """Return the column that is named like a time and goes one way: up is 1, down -1, any 0."""
    scores = {}
    for column in table.columns:
        words = words_of(column.bare_name)
        score = max((TIMES.get(word, 0.0) for word in words), default=0.0)
        score += sum(OTHERWISE.get(word, 0.0) for word in words) - 0.1 * len(words)
        finite = column.values[np.isfinite(column.values)]
        if score > 0.5 and len(finite) > 1 and np.mean(way * np.diff(finite) >= 0.0) > 0.9:
            scores[column] = score
    return max(scores, key=lambda column: scores[column]) if scores else None


def _groups(
    table: Table, joints: Sequence[str] | None, rename: Sequence[tuple[str, str]]
) -> dict[str, dict[str, TableColumn]]:
    """Return the columns by what they have in common and by what stands for a joint."""
    groups: dict[str, dict[str, TableColumn]] = {}
    for column in table.columns:
        for pattern, label in _readings(column, joints, rename):
            groups.setdefault(pattern, {})[label] = column
    return groups


def _readings(
    column: TableColumn, joints: Sequence[str] | None, rename: Sequence[tuple[str, str]]
) -> Iterator[tuple[str, str]]:
    """Yield the ways to read a name as a pattern and what stands for the joint."""
    name = column.bare_name
    if column.array and name.endswith(']'):
        element = name[len(column.array) + 1 : -1]
        stem, dot, kind = element.rpartition('.')
        if dot and is_quantity(kind):
            yield f'{column.array}[{{}}.{kind}]', stem
        yield column.array, element
        return
    for joint in joints or ():
        for called in {joint, *(old + joint[len(new) :] for old, new in rename)}:
            if renamed(called, rename) == joint and called in name:
                yield name.replace(called, '{}', 1), called
    for match in _NUMBER.finditer(name):
        yield f'{name[: match.start()]}{{}}{name[match.end() :]}', match[0]
    if joints is None or len(joints) == 1:
        yield name, '1'
    if joints is None:
        yield from _named(name)


def _named(name: str) -> Iterator[tuple[str, str]]:
    """Read a name as a joint's with the quantity behind or in front: 'elbow/position'."""
    behind = re.fullmatch(r'(.*[/.])?([^/.]+)([/._ ])([A-Za-z]+)', name)
    if behind and is_quantity(behind[4]) and not behind[2].isdigit():
        yield f'{behind[1] or ""}{{}}{behind[3]}{behind[4]}', behind[2]
    ahead = re.fullmatch(r'([A-Za-z]+)([/._ ])([^/.]+)', name)
    if ahead and is_quantity(ahead[1]) and not ahead[3].isdigit():
        yield f'{ahead[1]}{ahead[2]}{{}}', ahead[3]


def _in_order(
    pattern: str,
    members: dict[str, TableColumn],
    joints: Sequence[str] | None,
    rename: Sequence[tuple[str, str]],
) -> ChosenColumns | None:
    """Return a family in the order of the joints; None where it does not fit them."""
    labels = list(members)
    if all(label.isdigit() for label in labels):
        labels.sort(key=by_number)
    if joints is not None:
        order = in_order(labels, joints, rename)
        if order is None:
            return None
        labels = [labels[k] for k in order]
    return ChosenColumns(tuple(members[label] for label in labels), tuple(labels), pattern)


def _score(pattern: str, quantity: QuantityName) -> float:
    words = words_of(pattern)
    own = max((WORDS[quantity].get(word, 0.0) for word in words), default=0.0)
    others = [table for name, table in WORDS.items() if name != quantity]
    other = max((table.get(word, 0.0) for table in others for word in words), default=0.0)
    if own <= 0.0 or own < other:
        return 0.0
    return (
        own
        + sum(MEASURED.get(word, 0.0) + OTHERWISE.get(word, 0.0) for word in words)
        - 0.01 * len(words)
    )


def _still(chosen: ChosenColumns) -> float:
    """Return what speaks against a family with columns that never change: they are not filled."""
    finite = (column.values[np.isfinite(column.values)] for column in chosen.columns)
    still = [
        len(values) == 0 or float(np.ptp(values)) == 0.0  # noqa: RUF069 - as recorded
        for values in finite
    ]
    return 1.0 if any(still) else 0.0
