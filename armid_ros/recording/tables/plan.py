# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Choose the column and unit of each quantity in a table, and convert the table to a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
import textwrap

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray, Temperatures
from armid_ros.recording.columns import ColumnSettings, in_si, per_joint, renamed, TIME_UNITS
from armid_ros.recording.joint_state.decoder import JointSamples
from armid_ros.recording.recording import PositionRange, Recording
from armid_ros.recording.series import assemble, MAX_NOT_FINITE
from armid_ros.recording.tables.families import (
    choose,
    CURRENTS,
    guess,
    guess_time,
    QuantityColumns,
    QuantityName,
    words_of,
)
from armid_ros.recording.tables.table import Table, TableColumn
from armid_ros.recording.temperature import temperatures
import numpy as np
import numpy.typing as npt

_OPTIONAL_QUANTITIES: tuple[QuantityName, ...] = ('velocity', 'effort', 'temperature')
_SI_UNITS = {'position': 'rad', 'velocity': 'rad/s', 'effort': 'N m', 'temperature': 'degC'}
#: Factors from units to SI.
_TO_SI = {'deg': np.pi / 180, 'deg/s': np.pi / 180, 'mN m': 1e-3, 'N mm': 1e-3, 'mA': 1e-3}
_TO_SI |= {'mrad': 1e-3, 'kN m': 1e3, 'rpm': 2 * np.pi / 60, 'mm': 1e-3, 'mm/s': 1e-3}
_ANGLE_UNITS = ('deg', 'deg/s', 'rpm', 'mrad')


@dataclass(frozen=True)
class TablePlan:
    """
    Columns and units of all quantities in a table, as chosen by the user or guessed.

    Attributes
    ----------
    table : Table
        The table.
    joints : tuple of str
        Joint names, in the order of the columns.
    time : TableColumn or None
        Column of time; None for a constant known rate.
    time_unit : str
        Unit of the column of time.
    rate_hz : float or None
        Samples per second, if there is no column of time.
    sources : tuple of QuantityColumns
        Columns of each quantity, positions first.
    settings : ColumnSettings
        Settings of the user.
    notes : tuple of str
        Notes for the user.
    missing : tuple of QuantityColumns
        Quantities without columns.

    """

    table: Table
    joints: tuple[str, ...]
    time: TableColumn | None
    time_unit: str
    rate_hz: float | None
    sources: tuple[QuantityColumns, ...]
    settings: ColumnSettings
    notes: tuple[str, ...]
    missing: tuple[QuantityColumns, ...]

    @property
    def time_guessed(self) -> bool:
        """Whether the column of time was guessed."""
        return self.settings.time is None and self.time is not None

    @property
    def guessed(self) -> bool:
        """Whether any column or unit was guessed."""
        return self.time_guessed or any(source.guessed for source in self.sources)

    @property
    def absent(self) -> tuple[str, ...]:
        """Return the quantities that the table lacks, such as 'effort' or 'effort of wrist'."""
        return tuple(
            f'{one.quantity} of {", ".join(one.missing)}' if one.pattern else one.quantity
            for one in self.missing
        )

    def lines(self) -> list[str]:
        """Return the plan as text, one line per quantity."""
        table = self.table
        lines = [f'{table.source}: {table.described}, {len(table)} rows of {len(table.columns)}']
        if self.time is None:
            lines.append(f'  time      none; {self.rate_hz:g} samples per second')
        else:
            guessed = ' (guessed)' if self.time_guessed else ''
            lines.append(f'  time      {self.time.name}, in {self.time_unit}{guessed}')
        for source in self.sources:
            names = [column.name for column in source.columns]
            shown = ', '.join(names) if len(names) <= 3 else f'{names[0]}, .., {names[-1]}'
            guessed = ' (guessed)' if source.guessed else ''
            lines.append(f'  {source.quantity:9s} {shown}, in {source.unit}{guessed}')
        for one in self.missing:
            why = f": '{one.pattern}' has no column of numbers for {', '.join(one.missing)}"
            lines.append(f'  {one.quantity:9s} none{why if one.pattern else ""}')
        lines.append(f'  joints    {", ".join(self.joints)}')
        taken = [self.time, *(one for source in self.sources for one in source.columns)]
        unread = tuple(one for one in table.columns if one not in taken)
        if unread:
            lines.append(f'  not read  {replace(table, columns=unread).listed()}')
        lines += [f'  note: {note}' for note in (*table.damage, *table.notes, *self.notes)]
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
    Choose the columns and units of the quantities in a table.

    Parameters
    ----------
    table : Table
        The table.
    settings : ColumnSettings
        Settings of the user; missing settings are guessed.
    joints : sequence of str, optional
        Joints of the robot, in order; by default those in the column names.
    slides : sequence of bool, optional
        Whether each joint is prismatic; by default none is.

    Raises
    ------
    RecordingError
        If there are no positions, or requested columns are missing or do not fit the joints.

    """
    position = _source(table, 'position', settings, joints)
    if not position.columns:
        if position.pattern:
            raise RecordingError(
                f"{table.source}: the columns '{position.pattern}' of positions lack the joints "
                f'{", ".join(position.missing)}; give the columns with --position or --rename, or '
                f'other joints with --joints. The columns are {table.listed()}'
            )
        of_joints = f' of {", ".join(joints)}' if joints else ''
        raise RecordingError(
            f'{table.source}: no columns of positions{of_joints} were found; name the columns by '
            f"--position 'q{{}}', a,b,c or '[1..6]' (from 0). The columns are {table.listed()}"
        )
    names = tuple(joints) if joints else position.joints(settings.rename)
    sliding = np.zeros(len(names), np.bool_) if slides is None else np.asarray(slides, np.bool_)
    sources, missing = [position], list[QuantityColumns]()
    for quantity in _OPTIONAL_QUANTITIES:
        found = _source(table, quantity, settings, names)
        if not found.columns and joints is None:
            # match joints by number, because names differ or are missing
            numbers = [str(k) for k in range(len(position.columns))]
            by_number = _source(table, quantity, settings, numbers)
            found = by_number if by_number.columns else found
        if found.columns:
            sources.append(found)
        elif quantity != 'temperature':
            missing.append(found)
    time, unit, rate = _time(table, settings)
    effort = next((one for one in sources if one.quantity == 'effort'), None)
    notes = list(_position_notes(position, settings, sliding))
    if effort is not None and not settings.effort_scale:
        name = effort.pattern
        if effort.unit in ('A', 'mA') or 'load' in name.lower():
            notes.append(f"efforts '{name}' seem to be currents; --current-gain makes them N m")
    scaled = tuple(_scaled(source, settings, names, sliding) for source in sources)
    remarks = tuple(notes), tuple(missing)
    return TablePlan(table, names, time, unit, rate, scaled, settings, *remarks)


def _source(
    table: Table,
    quantity: QuantityName,
    settings: ColumnSettings,
    joints: Sequence[str] | None,
) -> QuantityColumns:
    """Return the columns of a quantity as the user chose them, or as guessed; empty if missing."""
    given = getattr(settings, quantity)
    if given is not None and given.lower() == 'none':
        return QuantityColumns(quantity, '')
    if given is not None:
        chosen = choose(table, quantity, given, joints, settings.rename)
    else:
        chosen = guess(table, quantity, joints, settings.rename)
    if not chosen.columns:
        return chosen
    for column in chosen.columns if chosen.guessed else ():
        table.column(column.bare_name)  # raises an error if columns of this name differ
    unit = next((column.unit for column in chosen.columns if column.unit), '')
    if not unit and set(words_of(chosen.pattern)) & set(CURRENTS):
        unit = 'A'
    if quantity == 'temperature':
        return replace(chosen, unit=_SI_UNITS[quantity])
    factor = np.full(len(chosen.columns), _TO_SI.get(unit, 1.0))
    return replace(chosen, unit=unit or _SI_UNITS[quantity], factor=factor)


def _scaled(
    source: QuantityColumns,
    settings: ColumnSettings,
    joints: Sequence[str],
    slides: npt.NDArray[np.bool_],
) -> QuantityColumns:
    """Apply units of the user to columns of a quantity; degrees are for revolute joints only."""
    if source.quantity == 'temperature':
        return source
    if source.quantity == 'effort':
        if not settings.effort_scale:
            return source
        given = per_joint(settings.effort_scale, joints, 'the scale of efforts')
        unit = 'units of the file' if source.unit == 'N m' else source.unit
        factor = given * (1e-3 if source.unit == 'mA' else 1.0)
        return replace(source, factor=factor, unit=f'{unit} times {_text(given)}')
    if settings.position_scale:
        given = per_joint(settings.position_scale, joints, 'the scale of positions')
        return replace(source, factor=given, unit=f'units of the file times {_text(given)}')
    if settings.degrees and source.unit not in _ANGLE_UNITS:
        source = replace(source, factor=np.full(len(slides), np.pi / 180), unit='deg')
    if source.quantity == 'velocity' and source.unit == 'deg':
        source = replace(source, unit='deg/s')
    if source.unit in _ANGLE_UNITS and slides.any():
        way = 'm' if source.quantity == 'position' else 'm/s'
        unit = f'{source.unit}, of joints that slide in {way}'
        return replace(source, factor=np.where(slides, 1.0, source.factor), unit=unit)
    if slides.all() and source.unit in ('rad', 'rad/s'):
        return replace(source, unit=source.unit.replace('rad', 'm'))
    return source


def _text(values: FloatArray) -> str:
    return ', '.join(dict.fromkeys(f'{value:.6g}' for value in values))


def _position_notes(
    position: QuantityColumns, settings: ColumnSettings, slides: npt.NDArray[np.bool_]
) -> Iterator[str]:
    """Yield notes for the user on positions that are too large for rad or m."""
    if position.unit != 'rad' or settings.gear or settings.position_scale:
        return
    reach = np.fmax.reduce(np.abs(position.values()))
    for kind, unit, remedy in (
        (~slides & (not settings.degrees), 'rad', '--degrees, or motor angles (--gear)?'),
        (slides, 'm', '--position-scale, 0.001 for joints in mm?'),
    ):
        most = np.max(reach[kind], initial=0.0)
        if most > 4.5 * np.pi:  # the unit is probably neither rad nor m
            yield f'positions reach {most:.4g} {unit}: {remedy}'


def _time(table: Table, settings: ColumnSettings) -> tuple[TableColumn | None, str, float | None]:
    """Return the time column with its unit, or else the sampling rate [Hz]."""
    given = settings.time
    column: TableColumn | None = None
    if given is not None and given.lower() != 'none':
        column = table.column(given)
        if column is None:
            raise RecordingError(
                f"{table.source}: the table has no column '{given}', given with --time; its "
                f'columns are {table.listed()}'
            )
    elif settings.rate_hz is None and given is None:
        column = guess_time(table)
    if column is not None:
        table.column(column.name)  # raises an error if columns of this name differ
        return column, _time_unit(table, column, settings.time_unit), None
    rate = settings.rate_hz or table.rate_hz
    if rate is None:
        raise RecordingError(
            f'{table.source}: no column seems to be the time; name a column with --time, or give '
            f'the samples per second with --rate. The columns are {table.listed()}'
        )
    return None, 's', rate


def _time_unit(table: Table, column: TableColumn, given: str | None) -> str:
    """Return the unit of the time column: from the user, its name, or its time steps."""
    where = f'{table.source}: column {column.name}'
    steps = np.diff(column.finite)
    if len(steps) and np.mean(steps < 0.0) > 0.5:  # sorting would reverse the motion
        raise RecordingError(
            f'{where}: time decreases, from {column.values[0]:.6g} to {column.values[-1]:.6g}. '
            'Reverse the rows if the last row was measured first. If the rows are in order, '
            'ignore the column with --time none --rate HZ'
        )
    if given or column.unit in TIME_UNITS:
        return given or column.unit
    steps = steps[steps > 0.0]
    if not len(steps):
        raise RecordingError(f'{where}: time does not increase; give the rate with --rate')
    step = float(np.median(steps))
    # sampling periods of 20 us to 0.5 s
    fitting = [unit for unit, scale in TIME_UNITS.items() if 2e-5 <= step * scale <= 0.5]
    count = step == 1.0 and np.all(steps == np.rint(steps))  # noqa: RUF069 - 1, 2, 3
    if count or not fitting:
        raise RecordingError(
            f'{where}: the unit of a time with steps of {step:g} is not known; give the unit with '
            '--time-unit s or ms, or give the samples per second with --rate'
        )
    return fitting[0]


def converted(plan: TablePlan) -> Recording:
    """
    Convert a table to a recording, with the columns and units of a plan.

    Raises
    ------
    RecordingError
        If time does not increase, or more than a fifth of the rows lack a number.

    """
    table = plan.table
    t, start = _times(plan)
    stamped = np.isfinite(t)
    if np.mean(~stamped) > MAX_NOT_FINITE:
        raise RecordingError(
            f'{table.source}: {np.sum(~stamped)} of {len(table)} rows have no number as time; '
            'give another column with --time'
        )
    read = {source.quantity: source.values()[stamped] for source in plan.sources}
    samples = JointSamples(
        plan.joints,
        start + np.round(t[stamped] * 1e9).astype(np.int64),
        (read['position'], read.get('velocity'), read.get('effort')),
    )
    others: list[PositionRange] = []
    position, settings = plan.sources[0], plan.settings
    # joints that were not requested, if the unit is known
    if not (settings.gear or settings.zero) and len(set(position.factor)) == 1:
        for label, column in position.rest.items():
            values = column.finite * position.factor[0]
            if len(values):
                joint = renamed(label, settings.rename)
                others.append(PositionRange(joint, float(values.min()), float(values.max())))
    where = table.source
    if plan.time is not None:
        where += f': column {plan.time.name}'
    recording = assemble(
        where,
        plan.joints,
        [samples],
        {
            'unstamped': int(np.sum(~stamped)),
            'messages': len(table),
            'absent': plan.absent,
            'damage': '; '.join(table.damage),
        },
        source=table.source,
        topic='the table',
        others=tuple(others),
    )
    recording = replace(recording, temperature=_temperatures(plan, recording, t, start))
    sides = replace(settings, degrees=False, position_scale=(), effort_scale=())
    return in_si(recording, sides)  # units are converted by the plan


def _temperatures(
    plan: TablePlan, recording: Recording, t: FloatArray, start: int
) -> Temperatures | None:
    """Return temperatures of a table on the time base of a recording; None without any."""
    for source in plan.sources:
        if source.quantity == 'temperature':
            own = t + 1e-9 * (start - recording.start_ns)
            order = np.argsort(own, kind='stable')
            order = order[np.isfinite(own[order])]
            where = [f'{plan.table.source}: column {column.name}' for column in source.columns]
            values = source.values()[order].T
            return temperatures(where, [own[order]] * len(values), list(values))
    return None


def _times(plan: TablePlan) -> tuple[FloatArray, int]:
    """Return the times of rows [s], relative to a start stamp, and the start stamp [ns]."""
    if plan.time is None:
        assert plan.rate_hz is not None
        return np.arange(len(plan.table)) / plan.rate_hz, 10**9
    scale = TIME_UNITS[plan.time_unit]
    # latest stamp: nanoseconds after the year 2255 do not fit into 64 bits
    values = np.where(np.abs(plan.time.values * scale) < 9e9, plan.time.values, np.nan)
    stamped = np.flatnonzero(np.isfinite(values) & (values != 0.0))  # noqa: RUF069 - as it is written
    if len(stamped) and np.count_nonzero(values[: stamped[0]] == 0.0) > 1:  # noqa: RUF069 - as it is written
        values[: stamped[0]] = np.nan  # simulated time is zero before the first /clock
    there = values[np.isfinite(values)]
    if not len(there):
        raise RecordingError(
            f'{plan.table.source}: column {plan.time.name} has no valid time; give another column '
            'with --time'
        )
    origin = float(there[0])
    epoch = origin * scale > 1e8  # later times count from 1970
    # Differences first: nanoseconds since 1970 do not fit into a float.
    return (values - origin) * scale, int(origin * scale * 1e9) if epoch else 10**9
