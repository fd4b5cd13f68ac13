# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convert a table to a recording by a plan."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.errors import RecordingError
from armid_ros.motion import FloatArray
from armid_ros.recording.columns import in_si, renamed, TIME_UNITS
from armid_ros.recording.joint_state.decoder import JointSamples
from armid_ros.recording.recording import PositionRange, Recording
from armid_ros.recording.series import assemble, MAX_NOT_FINITE
from armid_ros.recording.tables.plan import TablePlan
import numpy as np


def measured(plan: TablePlan) -> Recording:
    """
    Convert a table to a recording.

    Raises
    ------
    RecordingError
        If time does not increase, or too many rows have a value that is not a number.

    """
    table = plan.table
    t, start = _times(plan)
    stamped = np.isfinite(t)
    for source in plan.sources:
        for column in source.chosen.columns:
            empty = np.flatnonzero(~np.isfinite(column.values))
            if len(empty) > MAX_NOT_FINITE * len(table):
                raise RecordingError(
                    f'{table.source}: column {column.name} has no number in {len(empty)} of '
                    f'{len(table)} rows, first in {table.where(int(empty[0]))}; leave '
                    f'{source.quantity} out with --{source.quantity} none, or mend the file'
                )
    if np.mean(~stamped) > MAX_NOT_FINITE:
        raise RecordingError(
            f'{table.source}: {np.sum(~stamped)} of {len(table)} rows have a time that is no '
            'number'
        )
    read = {source.quantity: source.values()[stamped] for source in plan.sources}
    samples = JointSamples(
        plan.joints,
        start + np.round(t[stamped] * 1e9).astype(np.int64),
        (read['position'], read.get('velocity'), read.get('effort')),
    )
    topic = 'the table'
    if 'effort' not in read and plan.unread:
        topic += f' (--effort names columns of it; not read are {plan.unread})'
    others: list[PositionRange] = []
    position, settings = plan.sources[0], plan.settings
    # of joints that were not requested, if their unit is known
    if not (settings.gear or settings.zero) and len(set(position.factor)) == 1:
        for label, column in position.chosen.rest.items():
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
            'damage': '; '.join(note for note in table.notes if 'cut off' in note),
        },
        source=table.source,
        topic=topic,
        others=tuple(others),
    )
    sides = replace(settings, degrees=False, position_scale=(), effort_scale=())
    return in_si(recording, sides)  # units are converted by the plan


def _times(plan: TablePlan) -> tuple[FloatArray, int]:
    """Return times [s] since a stamp, and this stamp [ns]; 1 s if none is known."""
    if plan.time is None:
        assert plan.rate_hz is not None
        return np.arange(len(plan.table)) / plan.rate_hz, 10**9
    scale = TIME_UNITS[plan.time_unit]
    # no stamp is later: nanoseconds beyond the year 2255 do not fit into 64 bits
    values = np.where(np.abs(plan.time.values * scale) < 9e9, plan.time.values, np.nan)
    stamped = np.flatnonzero(np.isfinite(values) & (values != 0.0))  # noqa: RUF069 - as it is written
    if len(stamped) and np.count_nonzero(values[: stamped[0]] == 0.0) > 1:  # noqa: RUF069 - as it is written
        values[: stamped[0]] = np.nan  # simulated time is zero before the first /clock
    there = values[np.isfinite(values)]
    if not len(there):
        raise RecordingError(f'{plan.table.source}: column {plan.time.name} has no time in it')
    origin = float(there[0])
    epoch = origin * scale > 1e8  # later times are counted from 1970
    # Differences first: counted from 1970, nanoseconds do not fit into a float.
    return (values - origin) * scale, int(origin * scale * 1e9) if epoch else 10**9
