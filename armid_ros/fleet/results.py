# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Parquet tables of the results of a fleet: their columns, and the rows of each bag and arm.

    bags/arm=A/day=D/BAG.parquet         one row: what was recorded, its fit and normal equations
    parameters/arm=A/day=D/BAG.parquet   one row per parameter: estimate of the single bag
    arms/arm=A/estimate.parquet          one row per parameter: estimate of all bags
    refused/arm=A/BAG.parquet            one row: why a bag is not used

A bag has one file in each data set, named after the bag, so a run overwrites only results of the
same bag. The file in ``bags`` is written last: if it exists, the results of the bag are complete.

"""

from __future__ import annotations

from collections.abc import Sequence
import datetime

from armid_ros.estimate import parameter_table
from armid_ros.fleet.bags import BagFile, digest, folder_of
from armid_ros.fleet.merge import BagSummary, FleetEstimate, MergedBags, Refused
from armid_ros.fleet.plan import Job
from armid_ros.fleet.store import Store
from armid_ros.identification.fitting.least_squares import NormalEquations
import numpy as np
import pyarrow as pa

_NUMBERS = pa.list_(pa.float64())
_STAMP = pa.timestamp('us', tz='UTC')

#: One row per bag.
BAGS = pa.schema(
    [
        ('bag', pa.string()),  # URL
        ('version', pa.string()),  # changes with the content of the bag
        ('settings', pa.string()),  # changes with the model and the filters
        ('run', pa.string()),  # run that wrote this row
        ('start', _STAMP),  # time of the first sample
        ('start_ns', pa.int64()),
        ('seconds', pa.float64()),
        ('samples', pa.int64()),
        ('bytes', pa.int64()),
        ('relative_error_percent', pa.float64()),  # of the fit to this bag alone
        ('condition_number', pa.float64()),
        ('joints', pa.list_(pa.string())),
        ('residual_std', _NUMBERS),  # of each joint [N m]
        ('lowest', _NUMBERS),  # positions [rad or m]
        ('highest', _NUMBERS),
        ('top_speed', _NUMBERS),  # [rad/s or m/s]
        ('notes', pa.list_(pa.string())),
        ('normal_equations', _NUMBERS),  # as NormalEquations.packed
    ]
)
_PARAMETER = [
    ('name', pa.string()),
    ('joint', pa.string()),
    ('unit', pa.string()),
    ('value', pa.float64()),
    ('std', pa.float64()),  # standard deviation
]
#: One row per parameter of a bag.
PARAMETERS = pa.schema([('bag', pa.string()), ('start', _STAMP), *_PARAMETER])
#: One row per parameter of an arm.
ARMS = pa.schema(
    [
        ('settings', pa.string()),
        ('versions', pa.string()),  # changes with the content of any bag
        ('bags', pa.int64()),
        ('seconds', pa.float64()),
        ('relative_error_percent', pa.float64()),
        ('condition_number', pa.float64()),
        *_PARAMETER,
    ]
)
#: One row per bag that is not used.
REFUSED = pa.schema(
    [
        ('bag', pa.string()),
        ('version', pa.string()),
        ('settings', pa.string()),
        ('run', pa.string()),
        ('failed', pa.bool_()),  # caused by a store or a worker, not by the bag
        ('reason', pa.string()),
    ]
)


def _part(data_set: str, bag: BagFile, day: str) -> str:
    """Return the path of a bag's results in a data set partitioned by arm and day."""
    return f'{data_set}/{folder_of(bag.arm)}/day={day}/{bag.name}.parquet'


def write_summary(store: Store, summary: BagSummary, job: Job) -> None:
    """Write the summary of a bag to the table `bags`, and its estimate to `parameters`."""
    bag, own = summary.bag, summary.own
    start = datetime.datetime.fromtimestamp(summary.start_ns * 1e-9, datetime.UTC)
    robot = job.arm.robot
    rows = [] if own is None else parameter_table(own.parameters, own.values, list(own.std))
    table = pa.Table.from_pylist(
        [{'bag': bag.url, 'start': start, **row} for row in rows], PARAMETERS
    )
    store.write_table(_part('parameters', bag, summary.day), table)
    row = {
        'bag': bag.url,
        'version': bag.version,
        'settings': job.digest,
        'run': job.run,
        'start': start,
        'start_ns': summary.start_ns,
        'seconds': summary.seconds,
        'bytes': bag.size,
        'relative_error_percent': None if own is None else own.relative_error_percent,
        'condition_number': None if own is None else own.condition_number,
        'joints': list(robot.joints),
        'residual_std': None if own is None else own.joint_std,
        'normal_equations': summary.normal.packed(),
        **summary.motion,
    }
    store.write_table(_part('bags', bag, summary.day), pa.Table.from_pylist([row], BAGS))
    for day in [] if bag.day else _days(store, bag):
        if day != summary.day:  # the same bag, recorded again on another day
            store.remove(_part('bags', bag, day))
            store.remove(_part('parameters', bag, day))
    store.remove(_refused(bag))


def find_summary(store: Store, bag: BagFile, job: Job) -> BagSummary | Refused | None:
    """
    Return the stored result of a bag; None without a result for the same settings.

    Results of an earlier run are used only if the job resumes.

    """
    refused = store.read_table(_refused(bag))
    if refused is not None:
        row = refused.to_pylist()[0]
        if _same(row, bag, job) and not row['failed']:
            return Refused(bag, row['reason'])
    days = [bag.day] if bag.day else _days(store, bag) if job.settings.resume else []
    for day in days:
        table = store.read_table(_part('bags', bag, day))
        row = {} if table is None else table.to_pylist()[0]
        if row and _same(row, bag, job):
            return BagSummary(
                bag,
                day,
                row['start_ns'],
                row['seconds'],
                NormalEquations.unpacked(np.array(row['normal_equations'])),
                computed=row['run'] == job.run,
            )
    return None


def write_refused(store: Store, refused: Refused, job: Job) -> None:
    """Write a refused bag and the reason to the table `refused`."""
    row = {
        'bag': refused.bag.url,
        'version': refused.bag.version,
        'settings': job.digest,
        'run': job.run,
        'failed': refused.failed,
        'reason': refused.reason,
    }
    store.write_table(_refused(refused.bag), pa.Table.from_pylist([row], REFUSED))
    for data_set in ('bags', 'parameters'):  # results of an earlier version of the bag
        for day in _days(store, refused.bag, data_set):
            store.remove(_part(data_set, refused.bag, day))


def write_arm(
    store: Store, arm: str, estimate: FleetEstimate, merged: MergedBags, job: Job
) -> None:
    """Write the estimate from all bags of an arm to the table `arms`."""
    common = {
        'settings': job.digest,
        'versions': _versions(merged.versions),
        'bags': len(merged.versions),
        'seconds': merged.seconds,
        'relative_error_percent': estimate.relative_error_percent,
        'condition_number': estimate.condition_number,
    }
    rows = parameter_table(estimate.parameters, estimate.values, list(estimate.std))
    table = pa.Table.from_pylist([{**common, **row} for row in rows], ARMS)
    store.write_table(_estimate(arm), table)


def arm_is_done(store: Store, arm: str, bags: Sequence[BagFile], job: Job) -> list[Refused] | None:
    """
    Return the refused bags of a stored estimate from exactly the given bags; else None.

    Returns
    -------
    list of Refused or None
        The refused bags; None if the arm has to be identified again.

    """
    table = store.read_table(_estimate(arm))
    row = {} if table is None or not len(table) else table.slice(0, 1).to_pylist()[0]
    if not row or row['settings'] != job.digest:
        return None
    refused = []
    listed = set(store.names(f'refused/{folder_of(arm)}/*.parquet'))
    for bag in bags:
        if _refused(bag) in listed:
            known = find_summary(store, bag, job)
            if not isinstance(known, Refused):
                return None
            refused.append(known)
    out = {one.bag.url for one in refused}
    used = [(bag.url, bag.version) for bag in bags if bag.url not in out]
    return refused if row['versions'] == _versions(used) else None


def _versions(versions: Sequence[tuple[str, str]]) -> str:
    """Return a hash of the (URL, version) pairs of bags."""
    return digest(*sorted('\t'.join(pair) for pair in versions))


def _same(row: dict[str, object], bag: BagFile, job: Job) -> bool:
    if row['version'] != bag.version or row['settings'] != job.digest:
        return False
    return job.settings.resume or row['run'] == job.run


def _refused(bag: BagFile) -> str:
    return f'refused/{folder_of(bag.arm)}/{bag.name}.parquet'


def _estimate(arm: str) -> str:
    return f'arms/{folder_of(arm)}/estimate.parquet'


def _days(store: Store, bag: BagFile, data_set: str = 'bags') -> list[str]:
    """Return the days for which the data set contains results of the bag."""
    pattern = f'{data_set}/{folder_of(bag.arm)}/day=*/{bag.name}.parquet'
    return [name.split('/')[2].removeprefix('day=') for name in store.names(pattern)]
