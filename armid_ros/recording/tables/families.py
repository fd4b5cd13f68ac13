# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Find the columns of each quantity in a table, by a pattern such as 'q{}' or by their names.

Columns whose names differ only in the name or number of a joint form a family.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
import re
from typing import Literal

from armid_ros.errors import RecordingError
from armid_ros.files.cells import listed
from armid_ros.motion import FloatArray
from armid_ros.recording.columns import renamed, Rules
from armid_ros.recording.tables.table import Table, TableColumn
import numpy as np

QuantityName = Literal['position', 'velocity', 'effort', 'temperature']

#: Words in the names of columns with motor currents.
CURRENTS = ('current', 'currents', 'curr', 'cur', 'i', 'iq', 'amp', 'amps', 'ampere', 'amperes')
#: Words in the names of columns with each quantity, and their scores.
WORDS: dict[QuantityName, dict[str, float]] = {
    'position': dict.fromkeys(('position', 'positions', 'pos', 'q', 'qpos', 'jpos'), 3.0)
    | dict.fromkeys(('angle', 'angles', 'ang', 'theta', 'qm'), 2.5)
    | {'state': 1.5, 'joint': 1.0, 'joints': 1.0},
    'velocity': dict.fromkeys(('velocity', 'velocities', 'vel', 'dq', 'qvel', 'qdot', 'jvel'), 3.0)
    | dict.fromkeys(('qd', 'speed', 'speeds', 'spd', 'dtheta', 'thetadot', 'dqm'), 2.5)
    | {'omega': 2.0},
    'effort': dict.fromkeys(('torque', 'torques', 'tau', 'effort', 'efforts'), 3.0)
    | dict.fromkeys(('trq', 'torq', 'eff', 'jtau', 'jeff'), 3.0)
    | dict.fromkeys(('tq', *CURRENTS), 2.5)
    | {'force': 2.0, 'load': 1.5, 'loads': 1.5, 'moment': 1.5, 'mom': 1.5},
    # higher, as these words lower the score of other quantities
    'temperature': dict.fromkeys(('temperature', 'temperatures', 'temp', 'temps'), 6.0),
}
#: Words in the names of columns with times, and their scores.
TIMES = dict.fromkeys(('time', 't', 'timestamp', 'timestamps'), 3.0) | dict.fromkeys(
    ('secs', 'seconds', 'elapsed', 'date', 'datetime'), 2.0
)
#: The time of measurement is preferred to the time of reception.
TIMES |= {'stamp': 3.5}
#: Words next to a quantity in the name of a column, and the weights that they add to its score.
_QUALIFIERS = (
    ('meas measured act actual fb feedback observation', 1.0),
    ('filt filtered est estimated se disc mot motor', -0.3),  # processed
    ('cmd command commanded des desired target ref reference con goal set setpoint', -2.0),
    ('ctrl control action ff feedforward traj leader', -2.0),  # not measured
    ('err error ext external fric friction pert model pred predicted residual limit', -2.0),
    ('min max std temp temperature tcp ee cart cartesian acc ddq imu rel', -2.0),
    ('init gravity kin dyn', -2.0),
)
QUALIFIERS = {word: weight for words, weight in _QUALIFIERS for word in words.split()}

_RANGE = re.compile(r'([\[{])(\d+)\.\.(\d+)[\]}]')


@dataclass(frozen=True, eq=False)
class QuantityColumns:
    """
    Table columns of one quantity, such as position: one column per joint, and the unit.

    Attributes
    ----------
    quantity : str
        'position', 'velocity' or 'effort'.
    pattern : str
        Pattern of the column names.
    columns : tuple of TableColumn
        One column per joint; empty if the quantity is missing.
    labels : tuple of str
        Part of each column name that identifies the joint: its name, a number, or the complete
        column name.
    rest : mapping of str to TableColumn
        Columns of other joints with the same pattern, by their label.
    missing : tuple of str
        Joints without a column of numbers; the quantity is missing unless this tuple is empty.
    guessed : bool
        Whether the columns were guessed.
    unit : str
        Unit in the file; empty until the unit is found.
    factor : ndarray, shape (n,)
        Factor from this unit to SI, for each joint.

    """

    quantity: QuantityName
    pattern: str
    columns: tuple[TableColumn, ...] = ()
    labels: tuple[str, ...] = ()
    rest: Mapping[str, TableColumn] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    guessed: bool = False
    unit: str = ''
    factor: FloatArray = field(default_factory=lambda: np.ones(1))

    def joints(self, rename: Rules = ()) -> tuple[str, ...]:
        """Return the joint names found in the column names, or joint_1, joint_2 and so on."""
        if all(label.isdigit() for label in self.labels):
            return tuple(f'joint_{k + 1}' for k in range(len(self.labels)))
        return tuple(renamed(label, rename) for label in self.labels)

    def values(self) -> FloatArray:
        """Return the values of the quantity in SI units, shape (N, n)."""
        return np.column_stack([c.values for c in self.columns]) * self.factor


def choose(
    table: Table,
    quantity: QuantityName,
    pattern: str,
    joints: Sequence[str] | None,
    rename: Rules = (),
) -> QuantityColumns:
    """
    Return the columns of a quantity, whose names match the pattern of the user.

    Parameters
    ----------
    table : Table
        Table with the columns.
    quantity : {'position', 'velocity', 'effort'}
        Quantity of the columns.
    pattern : str
        See ColumnSettings.
    joints : sequence of str or None
        Joints, if known; columns are matched to them by name, else by number.
    rename : sequence of (str, str)
        Pairs of joint names, or beginnings of them, in the file and their replacements.

    Raises
    ------
    RecordingError
        If no column matches, or the number of columns differs from that of the joints.

    """
    found = _matching(table, pattern)
    if not found:
        raise RecordingError(
            f"{table.source}: no column has the name or pattern '{pattern}', given with "
            f'--{quantity}; the columns are {table.listed()}'
        )
    labels = [label for label, _ in found]
    twice = [column.name for label, column in found if labels.count(label) > 1]
    if twice:
        raise RecordingError(
            f"{table.source}: '{pattern}', given with --{quantity}, matches several columns for "
            f'one joint: {", ".join(twice)}; list the columns with commas, or rename them'
        )
    members = dict(found)
    names = [renamed(label, rename) for label in labels]
    by_name = joints is None or set(joints) <= set(names)
    if not by_name and len(labels) == len(joints or ()) and (',' in pattern or len(labels) == 1):
        return QuantityColumns(quantity, pattern, tuple(members.values()), tuple(labels))
    family = _family(quantity, pattern, members, joints, rename)
    if family is not None:
        return family
    assert joints is not None
    matching = ', '.join(column.name for column in members.values())
    missing = ', '.join(joint for joint in joints if joint not in names)
    raise RecordingError(
        f"{table.source}: '{pattern}', given with --{quantity}, matches the columns {matching}, "
        f'but none is a column of {missing}. Columns are matched to the {len(joints)} joints by '
        'name, or by number if each joint has one. List the columns in the order of the joints, '
        'with commas, or use --rename or --joints'
    )


def guess(
    table: Table, quantity: QuantityName, joints: Sequence[str] | None, rename: Rules = ()
) -> QuantityColumns:
    """
    Find the columns whose names fit a quantity best; empty if no column fits.

    Parameters
    ----------
    table : Table
        Table with the columns.
    quantity : {'position', 'velocity', 'effort'}
        Quantity to find.
    joints : sequence of str or None
        Joints, if known; each needs a column.
    rename : sequence of (str, str)
        Pairs of joint names, or beginnings of them, in the file and their replacements.

    Returns
    -------
    QuantityColumns
        If no columns fit, the pattern is that of the columns of the most joints; it is empty if
        no joint has a column.

    """
    groups: dict[str, dict[str, TableColumn]] = {}  # by pattern, then by label of the joint
    for column in table.columns:
        for pattern, label in _patterns(column, joints, rename):
            groups.setdefault(pattern, {})[label] = column
    best: tuple[tuple[float, int], QuantityColumns] | None = None
    incomplete = QuantityColumns(quantity, '', missing=tuple(joints or ()))
    for pattern, members in groups.items():
        score = _score(pattern, quantity)
        family = _family(quantity, pattern, members, joints, rename)
        if family is not None:
            # constant columns are probably not measured
            score -= any(not np.any(np.diff(column.finite)) for column in family.columns)
        if score <= 0.0:
            continue
        if family is not None and (best is None or (score, len(family.columns)) > best[0]):
            best = (score, len(family.columns)), replace(family, guessed=True)
        names = [renamed(label, rename) for label in members]
        missing = tuple(joint for joint in joints or () if joint not in names)
        if len(missing) < len(incomplete.missing):
            incomplete = QuantityColumns(quantity, pattern, missing=missing)
    return best[1] if best else incomplete


def guess_time(table: Table) -> TableColumn | None:
    """Find the time column by its name; prefer one whose values increase."""
    scores = {}
    for column in table.columns:
        words = words_of(column.bare_name)
        score = max((TIMES.get(word, 0.0) for word in words), default=0.0)
        score += sum(QUALIFIERS.get(word, 0.0) for word in words) - 0.1 * len(words)
        steps = np.diff(column.finite)
        onwards = np.mean(steps >= 0.0) if len(steps) else 0.5
        if score > 0.5 and max(onwards, 1.0 - onwards) > 0.9:
            scores[column] = onwards > 0.5, score
    return max(scores, key=lambda column: scores[column]) if scores else None


def _family(
    quantity: QuantityName,
    pattern: str,
    members: Mapping[str, TableColumn],
    joints: Sequence[str] | None,
    rename: Rules,
) -> QuantityColumns | None:
    """Return a column for each joint, by joint name or number; None if a column is missing."""
    labels = list(members)
    numbered = all(label.isdigit() for label in labels)
    if numbered:
        labels.sort(key=_by_number)
    if joints is not None:
        of_joint = {renamed(label, rename): label for label in reversed(labels)}
        if set(joints) <= set(of_joint):
            labels = [of_joint[joint] for joint in joints]
        elif not numbered or len(labels) != len(joints):
            return None
    rest = {label: column for label, column in members.items() if label not in labels}
    columns = tuple(members[label] for label in labels)
    return QuantityColumns(quantity, pattern, columns, tuple(labels), rest)


def _by_number(label: str) -> tuple[int, str]:
    """Return a sort key that sorts labels of digits as numbers."""
    digits = label.lstrip('0')
    return len(digits), digits


def _matching(table: Table, pattern: str) -> list[tuple[str, TableColumn]]:
    """Return the columns that match a pattern, each with the joint label in its name."""
    exact = table.column(pattern)
    if exact is not None:
        return [('1', exact)]
    span = _RANGE.search(pattern)
    if span:
        numbers = [str(k) for k in range(int(span[2]), int(span[3]) + 1)]
        middle = '[{}]' if span[1] == '[' else '{}'
        names = [_RANGE.sub(middle.format(number), pattern, count=1) for number in numbers]
        columns = [table.column(name) for name in names]
        there = [column for column in columns if column is not None]
        return list(zip(numbers, there, strict=True)) if len(there) == len(columns) else []
    if '{}' in pattern:
        before, _, after = pattern.partition('{}')
        expression = re.compile(f'{re.escape(before)}(.+){re.escape(after)}')
        fits = (
            (expression.fullmatch(one.bare_name) or expression.fullmatch(one.name), one)
            for one in table.columns
        )
        labelled = [(match[1].strip('[]'), one) for match, one in fits if match]
        numbered = [one for one in labelled if one[0].isdigit()]
        return sorted(numbered, key=lambda one: _by_number(one[0])) or labelled
    members = [column for column in table.columns if column.array and column.array == pattern]
    if members:
        return [(column.name[len(pattern) + 1 : -1], column) for column in members]
    listed_columns: list[tuple[str, TableColumn]] = []
    for part in map(str.strip, listed(pattern)) if ',' in pattern else ():
        column = table.column(part)
        if column is None:
            raise RecordingError(
                f"{table.source}: the table has no column '{part}'; its columns are "
                f'{table.listed()}'
            )
        listed_columns.append((part, column))
    return listed_columns


def _patterns(
    column: TableColumn, joints: Sequence[str] | None, rename: Rules
) -> Iterator[tuple[str, str]]:
    """Yield all splits of a column name into a pattern and the label of a joint."""
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
    yield from (
        (f'{name[: match.start()]}{{}}{name[match.end() :]}', match[0])
        for match in re.finditer(r'\d+', name)
    )
    if joints is None or len(joints) == 1:
        yield name, '1'
    if joints is not None:
        return
    behind = re.fullmatch(r'(.*[/.])?([^/.]+)([/._ ])([A-Za-z]+)', name)
    if behind and is_quantity(behind[4]) and not behind[2].isdigit():
        yield f'{behind[1] or ""}{{}}{behind[3]}{behind[4]}', behind[2]
    ahead = re.fullmatch(r'([A-Za-z]+)([/._ ])([^/.]+)', name)
    if ahead and is_quantity(ahead[1]) and not ahead[3].isdigit():
        yield f'{ahead[1]}{ahead[2]}{{}}', ahead[3]


def _score(pattern: str, quantity: QuantityName) -> float:
    """Return a score of how well the words of a pattern fit a quantity; zero if they do not."""
    words = words_of(pattern)
    scores = {
        name: max((table.get(word, 0.0) for word in words), default=0.0)
        for name, table in WORDS.items()
    }
    own = scores[quantity]
    if own <= 0.0 or own < max(scores.values()):
        return 0.0
    return own + sum(QUALIFIERS.get(word, 0.0) for word in words) - 0.01 * len(words)


def words_of(name: str) -> list[str]:
    """Return the words of a column name in lower case: 'actual' and 'q' for 'actualQ_3'."""
    apart = re.sub(r'(?<=[a-z])(?=[A-Z])', ' ', name)
    apart = re.sub(r'\d+', ' ', apart)
    return [word.lower() for word in re.split(r'[^A-Za-z0-9]+', apart) if word]


def is_quantity(word: str) -> bool:
    """Return whether a word stands for a position, velocity, effort or temperature."""
    return any(word.lower() in words for words in WORDS.values())
