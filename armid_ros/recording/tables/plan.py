# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is read from which column, in which unit: settled, and shown, before anything is read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import textwrap

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording.series import LARGEST
from armid_ros.recording.tables.guess import guess, guess_time, Incomplete, incomplete, named_time
from armid_ros.recording.tables.patterns import choose, ChosenColumns
from armid_ros.recording.tables.settings import ColumnSettings, per_joint, TIME_UNITS
from armid_ros.recording.tables.table import Table, TableColumn
from armid_ros.recording.tables.words import CURRENTS, is_quantity, QuantityName, words_of
import numpy as np
import numpy.typing as npt

_OTHERS: tuple[QuantityName, ...] = ('velocity', 'effort')
#: What a unit is in SI.
_FACTORS = {'deg': np.pi / 180, 'deg/s': np.pi / 180, 'mN m': 1e-3, 'N mm': 1e-3, 'mA': 1e-3}
_FACTORS |= {'mrad': 1e-3, 'kN m': 1e3, 'rpm': 2 * np.pi / 60, 'mm': 1e-3, 'mm/s': 1e-3}
_TURNS = ('deg', 'deg/s', 'rpm', 'mrad')
#: Sampling periods that are recognised from the numbers alone [s].
_STEP = (2e-5, 0.5)
#: Positions further from zero are hardly in rad or m.
_FAR = 4.5 * np.pi


@dataclass(frozen=True)
class QuantitySource:
    """
    Where one quantity comes from.

    Attributes
    ----------
    quantity : str
        'position', 'velocity' or 'effort'.
    chosen : ChosenColumns
        Columns.
    unit : str
        Of the file.
    factor : ndarray, shape (n,)
        To SI.
    guessed : bool
        Whether nobody said so.
    rivals : tuple of str
        What else would have fitted.

    """

    quantity: QuantityName
    chosen: ChosenColumns
    unit: str
    factor: FloatArray
    guessed: bool
    rivals: tuple[str, ...] = ()

    def values(self) -> FloatArray:
        """Return the quantity in SI, shape (N, n)."""
        return np.column_stack([c.values for c in self.chosen.columns]) * self.factor


@dataclass(frozen=True)
class TablePlan:
    """
    What is read from where.

    Attributes
    ----------
    table : Table
        The file.
    joints : tuple of str
        In the order of the columns.
    time : TableColumn or None
        None for even steps of a known rate.
    time_unit : str
        Of that column.
    time_guessed : bool
        Whether nobody named it.
    rate_hz : float or None
        Where there is no column of time.
    sources : tuple of QuantitySource
        Position first.
    settings : ColumnSettings
        What was said.
    notes : tuple of str
        What a person should look at.
    incomplete : tuple of Incomplete
        What has columns for some of the joints only, and is not read.

    """

    table: Table
    joints: tuple[str, ...]
    time: TableColumn | None
    time_unit: str
    time_guessed: bool
    rate_hz: float | None
    sources: tuple[QuantitySource, ...]
    settings: ColumnSettings
    notes: tuple[str, ...] = ()
    incomplete: tuple[Incomplete, ...] = ()

    @property
    def guessed(self) -> bool:
        """Whether anything was not said but guessed."""
        return self.time_guessed or any(source.guessed for source in self.sources)

    def source(self, quantity: QuantityName) -> QuantitySource | None:
        """Return where a quantity comes from; None where it does not."""
        return next((one for one in self.sources if one.quantity == quantity), None)

    @property
    def absent(self) -> tuple[str, ...]:
        """Return what is not read, in words: 'effort of wrist'."""
        of = {one.quantity: f' of {", ".join(one.lacking)}' for one in self.incomplete}
        return tuple(name + of.get(name, '') for name in _OTHERS if self.source(name) is None)

    @property
    def unread(self) -> str:
        """Return the names of the columns that are not read, in words."""
        taken = [column for source in self.sources for column in source.chosen.columns]
        rest = [one for one in self.table.columns if one is not self.time and one not in taken]
        return replace(self.table, columns=tuple(rest)).listed() if rest else ''

    def lines(self) -> list[str]:
        """Return the plan for a person, in lines."""
        table = self.table
        lines = [f'{table.source}: {table.described}, {len(table)} rows of {len(table.columns)}']
        if self.time is None:
            lines.append(f'  time      none; {self.rate_hz:g} samples a second')
        else:
            lines.append(
                f'  time      {self.time.name}, in {self.time_unit}'
                f'{" (guessed)" if self.time_guessed else ""}'
            )
        for source in self.sources:
            names = [column.name for column in source.chosen.columns]
            shown = ', '.join(names) if len(names) <= 3 else f'{names[0]}, .., {names[-1]}'
            lines.append(
                f'  {source.quantity:9s} {shown}, in {source.unit}'
                f'{" (guessed)" if source.guessed else ""}'
            )
            if source.rivals:
                lines.append(f'            also fits: {", ".join(source.rivals)}')
        for quantity in _OTHERS:
            if self.source(quantity) is None:
                why = [f': {one}' for one in self.incomplete if one.quantity == quantity]
                lines.append(f'  {quantity:9s} none{"".join(why)}')
        lines.append(f'  joints    {", ".join(self.joints)}')
        if self.unread:
            lines.append(f'  not read  {self.unread}')
        lines += [f'  note: {note}' for note in (*table.notes, *self.notes)]
        return lines[:1] + [
            textwrap.fill(line, 80, subsequent_indent=' ' * 12, break_long_words=False)
            for line in lines[1:]
        ]


def plan(
    table: Table,
    settings: ColumnSettings,
    joints: Sequence[str] | None = None,
    slides: Sequence[bool] | None = None,
) -> TablePlan:
    """
    Settle what is read from where.

    Parameters
    ----------
    table : Table
        The file.
    settings : ColumnSettings
        What a person says; the rest is guessed.
    joints : sequence of str, optional
        Joints of the robot, in order; by default as the columns call them.
    slides : sequence of bool, optional
        Whether each of them is prismatic; by default none is.

    Raises
    ------
    RecordingError
        There are no positions, what was asked for is not there, or does not fit the joints.

    """
    position = _source(table, 'position', settings, joints)
    if position is None:
        raise RecordingError(_without_positions(table, settings, joints))
    names = tuple(joints) if joints else position.chosen.joints(settings.rename)
    sliding = np.zeros(len(names), np.bool_) if slides is None else np.asarray(slides, np.bool_)
    sources, lacking = [position], []
    for quantity in _OTHERS:
        found = _source(table, quantity, settings, names)
        if found is None and joints is None and getattr(settings, quantity) is None:
            # its joints are called otherwise, or not at all: their number decides
            numbers = [str(k) for k in range(len(position.chosen.columns))]
            found = _source(table, quantity, settings, numbers)
        if found is not None:
            sources.append(found)
        elif getattr(settings, quantity) is None:
            lacking.append(incomplete(table, quantity, names, settings.rename))
    time, unit, rate = _time(table, settings)
    return TablePlan(
        table,
        names,
        time,
        unit,
        settings.time is None and time is not None,
        rate,
        tuple(_scaled(source, settings, names, sliding) for source in sources),
        settings,
        tuple(_doubts(sources, settings, sliding)),
        tuple(one for one in lacking if one is not None),
    )


def _without_positions(
    table: Table, settings: ColumnSettings, joints: Sequence[str] | None
) -> str:
    """Say that there are no positions, or of which joints there are none."""
    known = incomplete(table, 'position', joints or (), settings.rename)
    if known is not None and settings.position is None:
        return (
            f'{table.source}: of positions {known}; name their columns with --position or '
            f'--rename, or leave joints out with --joints. Its columns are {table.listed()}'
        )
    of_joints = f' of {", ".join(joints)}' if joints else ''
    for name, cells in table.words.items():
        series = set(cells)
        if 2 <= len(series) <= len(cells) // 10 and any(map(is_quantity, words_of(min(series)))):
            return (
                f'{table.source}: the table is in long form, one value a row: column {name} says '
                f'of which series ({", ".join(sorted(series)[:3])}, ...); export one column a '
                'series, or pivot it: one row a stamp'
            )
    return (
        f'{table.source}: no columns seem to be positions{of_joints}; name them, as in '
        f"--position 'q{{}}' or --position a,b,c. Its columns are {table.listed()}"
    )


def _source(
    table: Table,
    quantity: QuantityName,
    settings: ColumnSettings,
    joints: Sequence[str] | None,
) -> QuantitySource | None:
    asked = getattr(settings, quantity)
    if asked is not None and asked.lower() == 'none':
        return None
    rivals: tuple[str, ...] = ()
    if asked is not None:
        chosen = choose(table, asked, joints, quantity, settings.rename)
    else:
        guesses = guess(table, quantity, joints, settings.rename)
        if not guesses:
            return None
        chosen = guesses[0]
        for column in chosen.columns:
            table.column(column.bare_name)  # which has to be one
        taken = {id(column) for column in chosen.columns}
        rivals = tuple(
            dict.fromkeys(
                one.pattern
                for one in guesses[1:]
                if not taken & {id(column) for column in one.columns}
                and len(one.columns) == len(chosen.columns)
            )
        )[:4]
    unit = next((column.unit for column in chosen.columns if column.unit), '')
    if not unit and set(words_of(chosen.pattern)) & set(CURRENTS):
        unit = 'A'
    plain = {'position': 'rad', 'velocity': 'rad/s', 'effort': 'N m'}[quantity]
    factor = np.full(len(chosen.columns), _FACTORS.get(unit, 1.0))
    return QuantitySource(quantity, chosen, unit or plain, factor, asked is None, rivals)


def _scaled(
    source: QuantitySource,
    settings: ColumnSettings,
    joints: Sequence[str],
    slides: npt.NDArray[np.bool_],
) -> QuantitySource:
    """Apply what a person says of units; degrees are those of joints that turn."""
    if source.quantity == 'effort':
        if settings.effort_scale:
            given = per_joint(settings.effort_scale, joints, 'the scale of efforts')
            unit = 'units of the file' if source.unit == 'N m' else source.unit
            factor = given * (1e-3 if source.unit == 'mA' else 1.0)
            return replace(source, factor=factor, unit=f'{unit} times {_short(given)}')
        return source
    if settings.position_scale:
        given = per_joint(settings.position_scale, joints, 'the scale of positions')
        return replace(source, factor=given, unit=f'units of the file times {_short(given)}')
    if settings.degrees and source.unit not in _TURNS:
        source = replace(source, factor=np.full(len(slides), np.pi / 180), unit='deg')
    if source.quantity == 'velocity' and source.unit == 'deg':
        source = replace(source, unit='deg/s')
    if source.unit in _TURNS and slides.any():
        way = 'm' if source.quantity == 'position' else 'm/s'
        unit = f'{source.unit}, of joints that slide in {way}'
        return replace(source, factor=np.where(slides, 1.0, source.factor), unit=unit)
    if slides.all() and source.unit in ('rad', 'rad/s'):
        return replace(source, unit=source.unit.replace('rad', 'm'))
    return source


def _short(values: FloatArray) -> str:
    texts = [f'{value:.6g}' for value in values]
    return texts[0] if len(set(texts)) == 1 else ', '.join(texts)


def _doubts(
    sources: Sequence[QuantitySource], settings: ColumnSettings, slides: npt.NDArray[np.bool_]
) -> list[str]:
    doubts = []
    for source in sources:
        amps = source.unit in ('A', 'mA') or 'load' in source.chosen.pattern.lower()
        if source.quantity == 'effort' and amps and not settings.effort_scale:
            doubts.append(
                f"efforts '{source.chosen.pattern}' seem to be currents; --current-gain makes "
                'them N m'
            )
        if source.quantity == 'position' and source.unit == 'rad':
            values = np.abs(source.values())
            reach = np.fmax.reduce(np.where(values < LARGEST, values, np.nan))
            doubts += _far(reach, settings, slides)
    return doubts


def _far(
    reach: FloatArray, settings: ColumnSettings, slides: npt.NDArray[np.bool_]
) -> Iterator[str]:
    """Doubt the unit of positions, given how far each joint is from zero, shape (n,)."""
    if settings.gear or settings.position_scale:
        return
    far = reach > _FAR
    if np.any(far & ~slides) and not settings.degrees:
        largest = reach[far & ~slides].max()
        yield f'positions reach {largest:.4g}: --degrees, or motor angles (--gear)?'
    if np.any(far & slides):
        turned = 'pi/180' if settings.degrees else '1'
        scale = ','.join('0.001' if one else turned for one in slides)
        largest = reach[far & slides].max()
        yield f'positions that slide reach {largest:.4g} m: --position-scale {scale} if in mm?'


def _time(table: Table, settings: ColumnSettings) -> tuple[TableColumn | None, str, float | None]:
    """Return the column of time and its unit, or None and the rate."""
    asked = settings.time
    column: TableColumn | None
    if asked is not None and asked.lower() != 'none':
        column = table.column(asked)
        if column is None:
            raise RecordingError(
                f"{table.source}: there is no column '{asked}' of time; its columns are "
                f'{table.listed()}'
            )
    elif settings.rate_hz is not None or asked is not None:
        column = None
    else:
        column = guess_time(table)
    if column is not None:
        table.column(column.name)  # which has to be one
        steps = np.diff(column.values[np.isfinite(column.values)])
        if len(steps) and np.mean(steps < 0.0) > 0.5:  # sorting would turn the motion round
            raise RecordingError(
                f'{table.source}: column {column.name} runs backwards, from '
                f'{column.values[0]:.6g} to {column.values[-1]:.6g}: turn the rows round if the '
                'last was measured first, or leave the column out with --time none --rate HZ if '
                'they are in order'
            )
        return column, settings.time_unit or _time_unit(table, column), None
    rate = settings.rate_hz or table.rate_hz
    if rate is None:
        named = named_time(table, 0.0)
        if named is not None and asked is None:
            raise RecordingError(
                f'{table.source}: column {named.name} goes up and down, as no time does; does '
                'every name of the header stand above its own column?'
            )
        raise RecordingError(
            f'{table.source}: no column of time; name it with --time, or give the samples per '
            f'second with --rate. Its columns are {table.listed()}'
        )
    return None, 's', rate


def _time_unit(table: Table, column: TableColumn) -> str:
    if column.unit in TIME_UNITS:
        return column.unit
    steps = np.diff(column.values[np.isfinite(column.values)])
    steps = steps[steps > 0.0]
    if not len(steps):
        raise RecordingError(f'{table.source}: column {column.name} does not increase')
    step = float(np.median(steps))
    if step == 1.0 and np.all(steps == np.rint(steps)):  # noqa: RUF069 - a count
        raise RecordingError(
            f'{table.source}: column {column.name} counts 1, 2, 3; give its unit with '
            '--time-unit s or ms, or the samples per second with --rate'
        )
    fitting = [u for u, scale in TIME_UNITS.items() if _STEP[0] <= step * scale <= _STEP[1]]
    if not fitting:
        raise RecordingError(
            f'{table.source}: column {column.name} goes in steps of {step:g}; say in which unit '
            'with --time-unit'
        )
    return fitting[0]
