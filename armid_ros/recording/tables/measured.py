# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From a table and a plan to a recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording.joint_state.decoder import JointSamples
from armid_ros.recording.recording import PositionRange, Recording
from armid_ros.recording.series import longest_in_order, MAX_NOT_FINITE, not_finite, recorded
from armid_ros.recording.tables.of_bags import in_si
from armid_ros.recording.tables.patterns import not_chosen
from armid_ros.recording.tables.plan import TablePlan
from armid_ros.recording.tables.settings import TIME_UNITS
from armid_ros.recording.tables.words import QuantityName
import numpy as np
import numpy.typing as npt

#: Times later than this count from 1970 [s].
_EPOCH = 1e8
#: No stamp is later: nanoseconds beyond the year 2255 do not fit into 64 bits [s].
_LATEST = 9e9


def measured(plan: TablePlan) -> Recording:
    """
    Return what a table holds.

    Raises
    ------
    RecordingError
        Time stands still, or too many rows have a value that is no number.

    """
    table = plan.table
    t, start = _times(plan)
    values = {source.quantity: source.values() for source in plan.sources}
    stamped = np.isfinite(t)
    kept, culprits = _finite(plan, stamped, values)
    rows = np.flatnonzero(kept & stamped)
    quantities = (values.get(name) for name in ('position', 'velocity', 'effort'))
    read = tuple(None if array is None else array[rows] for array in quantities)
    counts: Counter[str] = Counter()
    stamps = np.round(t[rows] * 1e9).astype(np.int64)
    series = longest_in_order(JointSamples(plan.joints, stamps, read), counts)
    found = len(series) + counts['duplicates']
    if counts['duplicates'] > 0.5 * found:
        raise RecordingError(
            f'{table.source}: column {plan.time.name if plan.time else "time"} stands still in '
            f'{counts["duplicates"]} of {found} rows; name another with --time, or give --rate'
        )
    if len(series) < 2:
        raise RecordingError(f'{table.source}: {len(series)} rows with numbers are left')
    counts['nan'] = int((~kept & stamped).sum())
    counts['unstamped'] += int((~stamped).sum())
    met = {
        **counts,
        'messages': len(table),
        'not_finite': culprits,
        'absent': plan.absent,
        'damage': '; '.join(note for note in table.notes if 'cut off' in note),
    }
    topic = 'the table'
    if plan.source('effort') is None and plan.unread:
        topic += f' (--effort names columns of it; not read are {plan.unread})'
    about = {'start_ns': start, 'source': table.source, 'topic': topic}
    recording = recorded(series, met, others=tuple(_others(plan)), **about)
    sides = replace(plan.settings, degrees=False, position_scale=(), effort_scale=())
    return in_si(recording, sides)  # units are those of the plan


def _times(plan: TablePlan) -> tuple[FloatArray, int]:
    """Return times [s], and the stamp of the first row [ns]; zero where it is not known."""
    if plan.time is None:
        assert plan.rate_hz is not None
        return np.arange(len(plan.table)) / plan.rate_hz, 0
    scale = TIME_UNITS[plan.time_unit]
    values = np.where(np.abs(plan.time.values * scale) < _LATEST, plan.time.values, np.nan)
    stamped = np.flatnonzero(np.isfinite(values) & (values != 0.0))  # noqa: RUF069 - as it is written
    if len(stamped) and np.count_nonzero(values[: stamped[0]] == 0.0) > 1:  # noqa: RUF069 - as it is written
        values[: stamped[0]] = np.nan  # simulation time before /clock
    there = values[np.isfinite(values)]
    if not len(there):
        raise RecordingError(f'{plan.table.source}: column {plan.time.name} has no time in it')
    origin = float(there[0])
    epoch = origin * scale > _EPOCH
    # Differences first: counted from 1970, nanoseconds do not fit into a float.
    return (values - origin) * scale, int(origin * scale * 1e9) if epoch else 0


def _finite(
    plan: TablePlan,
    stamped: npt.NDArray[np.bool_],
    values: Mapping[QuantityName, FloatArray],
) -> tuple[npt.NDArray[np.bool_], tuple[str, ...]]:
    """Return where everything is a number, and whose values are not; refuse when many are not."""
    bad, culprits = not_finite(plan.joints, values.items(), len(stamped))
    lost = int((bad | ~stamped).sum())
    if lost > MAX_NOT_FINITE * len(stamped):
        for source in plan.sources:
            for column in source.chosen.columns:
                empty = np.flatnonzero(~np.isfinite(column.values))
                if len(empty) > MAX_NOT_FINITE * len(stamped):
                    where = plan.table.where(int(empty[0]))
                    raise RecordingError(
                        f'{plan.table.source}: column {column.name} has no number in '
                        f'{len(empty)} of {len(stamped)} rows, first in {where}; leave '
                        f'{source.quantity} out with --{source.quantity} none, or mend the file'
                    )
        raise RecordingError(
            f'{plan.table.source}: {lost} of {len(stamped)} rows have a value, or a time, that is '
            f'no number ({"; ".join(culprits) or "time"})'
        )
    return ~bad, culprits


def _others(plan: TablePlan) -> Iterator[PositionRange]:
    """Yield where joints are that were not asked for, as far as their unit is known."""
    source, settings = plan.source('position'), plan.settings
    if source is None or settings.gear or settings.zero or len(set(source.factor)) != 1:
        return
    for joint, column in not_chosen(plan.table, source.chosen, settings.rename).items():
        values = column.values[np.isfinite(column.values)] * source.factor[0]
        if len(values):
            yield PositionRange(joint, float(values.min()), float(values.max()))
