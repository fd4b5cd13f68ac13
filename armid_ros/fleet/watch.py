# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Changes and wear of the arms of a fleet, from their estimates over time.

    watch/arms.parquet      one row per arm: health and adjusted p-value
    watch/changes.parquet   one row per significant change of an arm
    watch/wear.parquet      one row per parameter of an effect: its slope per month
    alarms.jsonl            one line per change, as JSON

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import datetime
import json
from typing import Any

from armid_ros.changes.histories import (
    HistoryChange,
    judge,
    Judged,
    ParameterHistory,
    significant,
    spreads,
    wear,
    without_days,
)
from armid_ros.errors import FleetError
from armid_ros.estimate import measured, name_in_words, ParameterName
from armid_ros.fleet.bags import DAY_NS
from armid_ros.fleet.plan import document, kind_arm
from armid_ros.fleet.store import Store
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.report.parameter_tables import full_label
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

#: Name of the series of residuals: logarithms of their standard deviations.
RESIDUAL = 'residual'

CHANGES = pa.schema(
    [
        ('arm', pa.string()),
        ('kind', pa.string()),  # step or trend
        ('name', pa.string()),
        ('joint', pa.string()),
        ('unit', pa.string()),
        ('last_day', pa.string()),  # last bag before a step; first bag of a trend
        ('first_day', pa.string()),  # first bag after a step; last bag of a trend
        ('bag', pa.string()),  # URL of the bag on first_day
        ('level', pa.float64()),  # value before the change
        ('size', pa.float64()),  # change of the value by a step, or in a month of a trend
        ('std', pa.float64()),
        ('p', pa.float64()),  # p-value of this parameter
        ('adjusted_p', pa.float64()),  # p-value of the arm, corrected for the number of arms
        ('text', pa.string()),
    ]
)
WEAR = pa.schema(
    [
        ('arm', pa.string()),
        ('name', pa.string()),
        ('joint', pa.string()),
        ('unit', pa.string()),
        ('per_month', pa.float64()),
        ('lower', pa.float64()),  # 95 % interval
        ('upper', pa.float64()),
    ]
)
ARMS = pa.schema(
    [
        ('arm', pa.string()),
        ('health', pa.string()),  # changed, wearing, healthy or too few bags
        ('bags', pa.int64()),
        ('refused', pa.int64()),
        ('adjusted_p', pa.float64()),
        ('relative_error_percent', pa.float64()),  # median of its bags
    ]
)


@dataclass(frozen=True, eq=False)
class WatchedArm:
    """
    Estimates of an arm over time, and significant changes of the estimates.

    Attributes
    ----------
    arm : str
        Name of the arm.
    kind : str
        Kind of the arm, a key of fleet.json.
    series : tuple of ParameterHistory
        Histories of the parameters, and of the logarithms of the residuals.
    bags : tuple of dict
        Rows of the table ``bags`` in order of time, without normal equations.
    judged : Judged
        Results of the tests.
    named : tuple of HistoryChange
        Significant changes of the arm.
    refused : tuple of dict
        Rows of the table ``refused``.
    wear : tuple of dict
        Rows of the table ``watch/wear``.

    """

    arm: str
    kind: str
    series: tuple[ParameterHistory, ...]
    bags: tuple[dict[str, Any], ...]
    judged: Judged
    named: tuple[HistoryChange, ...]
    refused: tuple[dict[str, Any], ...]
    wear: tuple[dict[str, Any], ...]

    @property
    def health(self) -> str:
        """Health of the arm: changed, wearing, healthy or too few bags."""
        if self.named:
            return 'changed' if self.named[0].kind == 'step' else 'wearing'
        return 'healthy' if self.judged.changes else 'too few bags'

    @property
    def error(self) -> float | None:
        """Median relative torque error of the arm's bags [%]; None if no bag was fitted."""
        errors = [e for row in self.bags if (e := row['relative_error_percent']) is not None]
        return float(np.median(errors)) if errors else None

    def bag_at(self, change: HistoryChange) -> dict[str, Any]:
        """Return the table row of the first bag after a step, or of the last bag of a trend."""
        day = change.series.days[change.index if change.kind == 'step' else -1]
        return min(self.bags, key=lambda row: abs(row['start_ns'] / DAY_NS - day))


@dataclass(frozen=True, eq=False)
class Watch:
    """
    Estimates of each arm of a fleet over time, and the significant changes of each arm.

    Attributes
    ----------
    arms : tuple of WatchedArm
        All arms; arms with a significant change first.
    alpha : float
        False discovery rate.

    """

    arms: tuple[WatchedArm, ...]
    alpha: float


def watch_fleet(store: Store, alpha: float = 0.05) -> Watch:
    """
    Test the parameter estimates of all arms of a fleet for steps and trends over time.

    Raises
    ------
    FleetError
        If there are no results.

    """
    facts = document(store)
    kind_of: Mapping[str, str] = facts.get('arms', {})
    if not kind_of:
        raise FleetError(f'{store.url}: no fleet results; run `armid fleet identify` first')
    bags = _by_arm(_table(store, 'bags').drop_columns(['normal_equations']))
    for rows in bags.values():
        rows.sort(key=lambda row: (row['start_ns'], row['bag']))
    refused = _by_arm(store.data_set('refused'))
    by_kind: dict[str, list[ParameterHistory]] = {}
    for one in _series(_table(store, 'parameters'), bags):
        by_kind.setdefault(kind_of.get(one.arm, ''), []).append(one)
    wearing: set[str] = set()
    for key, kind in facts['kinds'].items():
        arm = kind_arm(store, kind, key)
        wearing.update(one.name for one in arm.parameters[len(arm.robot.rigid_parameters) :])
    kinds, arms = [], []
    own: dict[str, list[ParameterHistory]] = {}
    worn: dict[str, list[dict[str, Any]]] = {}
    for group in by_kind.values():
        # remove the deviations that all arms of one kind share on a day
        without = without_days(group)
        spread = spreads(without)
        kinds.append((without, spread))
        for one, other in zip(group, without, strict=True):
            own.setdefault(one.arm, []).append(one)
            if one.name in wearing and len(other.values) > 1:
                slope, std = wear(other, spread[other.parameter])
                row = {'arm': one.arm, 'name': one.name, 'joint': one.joint, 'unit': one.unit}
                ends = {'lower': slope - HALF_WIDTH * std, 'upper': slope + HALF_WIDTH * std}
                worn.setdefault(one.arm, []).append({**row, 'per_month': slope, **ends})
    for judged in judge(kinds):
        name = judged.arm
        arms.append(
            WatchedArm(
                name,
                kind_of.get(name, ''),
                tuple(own[name]),
                tuple(bags.get(name, ())),
                judged,
                significant(judged, alpha),
                tuple(refused.get(name, ())),
                tuple(row for row in worn.get(name, ()) if np.isfinite(row['upper'])),
            )
        )
    return Watch(tuple(arms), alpha)


def write_watch(store: Store, found: Watch) -> None:
    """Write the Parquet tables of changes, wear and arms, and alarms.jsonl."""
    changes = [row for arm in found.arms for row in change_rows(arm)]
    arms = [
        {
            'arm': arm.arm,
            'health': arm.health,
            'bags': len(arm.bags),
            'refused': len(arm.refused),
            'adjusted_p': arm.judged.adjusted,
            'relative_error_percent': arm.error,
        }
        for arm in found.arms
    ]
    wear = [row for arm in found.arms for row in arm.wear]
    for name, rows, schema in (
        ('changes', changes, CHANGES),
        ('wear', wear, WEAR),
        ('arms', arms, ARMS),
    ):
        store.write_table(f'watch/{name}.parquet', pa.Table.from_pylist(rows, schema))
    store.write('alarms.jsonl', ''.join(json.dumps(row) + '\n' for row in changes))


def change_rows(arm: WatchedArm) -> list[dict[str, Any]]:
    """Return the significant changes of an arm as table rows, sorted by p-value."""
    rows = []
    for change in arm.named:
        series = change.series
        last, first = (change.index - 1, change.index) if change.kind == 'step' else (0, -1)
        rows.append(
            {
                'arm': arm.arm,
                'kind': change.kind,
                'name': series.name,
                'joint': series.joint,
                'unit': series.unit,
                'last_day': day_text(float(series.days[last])),
                'first_day': day_text(float(series.days[first])),
                'bag': arm.bag_at(change)['bag'],
                'level': change.level,
                'size': change.size,
                'std': change.std,
                'p': change.p,
                'adjusted_p': arm.judged.adjusted,
                'text': sentence(change),
            }
        )
    return rows


def sentence(change: HistoryChange) -> str:
    """Describe a parameter change in a sentence: name, size with 95 % interval, and date."""
    series = change.series
    what = parameter_label(*series.parameter)
    if series.name == RESIDUAL:
        reach = HALF_WIDTH * change.std
        factor, lower, upper = np.exp(change.size + np.array([0.0, -reach, reach]))
        by = f'by a factor of {factor:.3g} ({lower:.3g} to {upper:.3g})'
        stepped = f'changed {by}'
    else:
        size, half = measured(change.size, HALF_WIDTH * change.std)
        sign = '+' * (change.size > 0.0)
        by = f'by {sign}{size} ± {half} {series.unit}'.rstrip()
        old, new = (
            measured(change.level + size, HALF_WIDTH * change.std)[0]
            for size in (0.0, change.size)
        )
        verb = 'rose' if change.size > 0.0 else 'fell'
        stepped = f'{verb} from {old} to {new} ± {half} {series.unit}'.rstrip()
    if change.kind == 'trend':
        return f'{what} drifts {by} a month since {day_text(float(series.days[0]))}'
    last, first = (day_text(float(series.days[k])) for k in (change.index - 1, change.index))
    when = f'on {first}' if last == first else f'between {last} and {first}'
    return f'{what} {stepped} {when}'


def day_text(days: float) -> str:
    """Format a number of days since 1970 as a date, such as 2026-01-31."""
    moment = datetime.datetime.fromtimestamp(86_400.0 * days, datetime.UTC)
    return moment.date().isoformat()


def parameter_label(name: str, joint: str) -> str:
    """Return the name of a watched parameter in words: 'viscous coefficient of elbow'."""
    if name == RESIDUAL:
        return f'residual torque of {joint}'
    if name.isidentifier() and '_' in name:
        return f'{name_in_words(name)} of {joint}'
    return full_label(ParameterName(name, joint, ''))


def _table(store: Store, data_set: str) -> pa.Table:
    table = store.data_set(data_set)
    if table is None:
        raise FleetError(f'{store.url}: no table {data_set}; run `armid fleet identify` first')
    return table


def _by_arm(table: pa.Table | None) -> dict[str, list[dict[str, Any]]]:
    rows: dict[str, list[dict[str, Any]]] = {}
    for row in [] if table is None else table.to_pylist():
        rows.setdefault(str(row['arm']), []).append(row)
    return rows


def _series(
    parameters: pa.Table, bags: Mapping[str, list[dict[str, Any]]]
) -> list[ParameterHistory]:
    """Return histories, for all arms, of each parameter and of each joint's log residual."""
    found = []
    for arm, own in sorted(bags.items()):
        fitted = [row for row in own if row['residual_std']]
        days = np.array([row['start_ns'] / DAY_NS for row in fitted])
        logs = np.log(np.maximum([row['residual_std'] for row in fitted], 1e-300))
        for j, joint in enumerate(fitted[0]['joints'] if fitted else ()):
            none = np.zeros(len(fitted))
            found.append(ParameterHistory(arm, RESIDUAL, joint, '', days, logs[:, j], none))
    # parameters in the order of bags, by parameter
    rows = [row for _, own in sorted(bags.items()) for row in own]
    days = np.array([row['start_ns'] / DAY_NS for row in rows])
    place = pc.index_in(parameters['bag'], value_set=pa.array([row['bag'] for row in rows]))
    table = parameters.append_column('place', place).filter(pc.is_valid(place)).sort_by('place')
    table = table.set_column(
        table.column_names.index('arm'), 'arm', pc.cast(table['arm'], pa.string())
    )
    keys, numbers = ('arm', 'name', 'joint', 'unit'), ('place', 'value', 'std')
    groups = table.group_by(keys, use_threads=False).aggregate([(one, 'list') for one in numbers])
    for arm, name, joint, unit, *lists in zip(
        *(groups[one].to_pylist() for one in keys),
        *(groups[f'{one}_list'] for one in numbers),
        strict=True,
    ):
        at, values, std = (one.values.to_numpy(zero_copy_only=False) for one in lists)
        found.append(ParameterHistory(arm, name, joint, unit, days[at], values, std))
    return found
