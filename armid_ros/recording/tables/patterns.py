# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From 'q{}' to the columns of the joints, in their order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import re

from armid_ros.errors import RecordingError
from armid_ros.files.cells import listed
from armid_ros.recording.tables.settings import renamed
from armid_ros.recording.tables.table import Table, TableColumn

_RANGE = re.compile(r'([\[{])(\d+)\.\.(\d+)([\]}])')


@dataclass(frozen=True)
class ChosenColumns:
    """
    Columns of one quantity.

    Attributes
    ----------
    columns : tuple of TableColumn
        One a joint.
    labels : tuple of str
        What of each name stands for the joint: its name, a number, or the whole name.
    pattern : str
        How a person would ask for them.

    """

    columns: tuple[TableColumn, ...]
    labels: tuple[str, ...]
    pattern: str

    def joints(self, rename: Sequence[tuple[str, str]] = ()) -> tuple[str, ...]:
        """Return the joints' names as far as the columns have them; joint_1 and so on if not."""
        numbered = all(label.isdigit() for label in self.labels)
        names = tuple(
            f'joint_{k + 1}' if numbered else label for k, label in enumerate(self.labels)
        )
        return tuple(renamed(name, rename) for name in names)


def choose(
    table: Table,
    pattern: str,
    joints: Sequence[str] | None,
    what: str,
    rename: Sequence[tuple[str, str]] = (),
) -> ChosenColumns:
    """
    Return the columns that a person asks for.

    Parameters
    ----------
    table : Table
        Where they are.
    pattern : str
        See ColumnSettings.
    joints : sequence of str or None
        The joints, where they are known: columns are matched to them by name, else by number.
    what : str
        The quantity, for messages.
    rename : sequence of (str, str)
        From names in the file to names of the joints.

    Raises
    ------
    RecordingError
        Nothing fits, or not as many columns as there are joints.

    """
    found = _matching(table, pattern)
    if not found:
        raise RecordingError(
            f"{table.source}: no column is '{pattern}', given for {what}; its columns are "
            f'{table.listed()}'
        )
    columns, labels = list(found), list(found.values())
    twice = [column.name for column in columns if labels.count(found[column]) > 1]
    if twice:
        raise RecordingError(
            f"{table.source}: for {what}, '{pattern}' fits {' and '.join(twice)} for one joint; "
            'name the columns with commas, or give each a name of its own'
        )
    if joints is None:
        return ChosenColumns(tuple(columns), tuple(labels), pattern)
    order = in_order(labels, joints, rename, listed=',' in pattern or len(joints) == 1)
    if order is None:
        listed = ', '.join(column.name for column in columns)
        names = [renamed(label, rename) for label in labels]
        lacking = [joint for joint in joints if joint not in names]
        numbered = all(label.isdigit() for label in labels)
        problem = (
            f'{len(found)} columns fit ({listed}), and there are {len(joints)} joints '
            f'({", ".join(joints)}); name the columns in the order of the joints, with commas'
            if numbered
            else f'{listed} fit, and no column is that of {", ".join(lacking)}; columns are '
            'matched by joint name or number: see --rename and --joints'
        )
        raise RecordingError(f"{table.source}: for {what}, '{pattern}': {problem}")
    return ChosenColumns(
        tuple(columns[k] for k in order), tuple(labels[k] for k in order), pattern
    )


def in_order(
    labels: Sequence[str],
    joints: Sequence[str],
    rename: Sequence[tuple[str, str]],
    *,
    listed: bool = False,
) -> list[int] | None:
    """
    Return the positions of joints among labels: by name, else by number.

    None where names do not fit, and labels are neither numbers nor listed in the order of joints.

    """
    names = [renamed(label, rename) for label in labels]
    if set(joints) <= set(names):
        return [names.index(joint) for joint in joints]
    if len(labels) == len(joints) and (listed or all(label.isdigit() for label in labels)):
        return list(range(len(joints)))
    return None


def not_chosen(
    table: Table, chosen: ChosenColumns, rename: Sequence[tuple[str, str]] = ()
) -> dict[str, TableColumn]:
    """Return the columns that are called as those chosen are, by the names of their joints."""
    return {
        renamed(label, rename): column
        for column, label in _matching(table, chosen.pattern).items()
        if column not in chosen.columns
    }


def _matching(table: Table, pattern: str) -> dict[TableColumn, str]:
    """Return the columns that fit, in order, each with what stands for its joint."""
    exact = table.column(pattern)
    if exact is not None:
        return {exact: '1'}
    span = _RANGE.search(pattern)
    if span:
        brackets = span[1] == '['
        names = []
        for k in range(int(span[2]), int(span[3]) + 1):
            middle = f'[{k}]' if brackets else str(k)
            names.append((pattern[: span.start()] + middle + pattern[span.end() :], str(k)))
        found = {table.column(name): label for name, label in names}
        return {} if None in found else {c: label for c, label in found.items() if c is not None}
    if '{}' in pattern:
        return _by_placeholder(table, pattern)
    members = [column for column in table.columns if column.array and column.array == pattern]
    if members:
        return {column: column.name[len(pattern) + 1 : -1] for column in members}
    if ',' in pattern:
        parts = [(part.strip(), table.column(part.strip())) for part in listed(pattern)]
        missing = [part for part, column in parts if column is None]
        if missing:
            raise RecordingError(
                f"{table.source}: there is no column '{missing[0]}'; its columns are "
                f'{table.listed()}'
            )
        return {column: part for part, column in parts if column is not None}
    return {}


def _by_placeholder(table: Table, pattern: str) -> dict[TableColumn, str]:
    before, _, after = pattern.partition('{}')
    expression = re.compile(f'{re.escape(before)}(.+){re.escape(after)}')
    found = {}
    for column in table.columns:
        match = expression.fullmatch(column.bare_name) or expression.fullmatch(column.name)
        if match:
            found[column] = match[1].strip('[]')
    if found and any(label.isdigit() for label in found.values()):
        found = {column: label for column, label in found.items() if label.isdigit()}
        return dict(sorted(found.items(), key=lambda pair: by_number(pair[1])))
    return found


def by_number(label: str) -> tuple[int, str]:
    """Return what sorts labels of digits by their number, of whatever length."""
    digits = label.lstrip('0')
    return len(digits), digits
