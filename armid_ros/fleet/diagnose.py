# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Diagnosis of the arms that changed, with earlier bags of each arm as its baseline.

The model is identified from the last bags before the change. The diagnosis uses the first bags
after the change, and a further bag is held out for validation. Results:

    watch/diagnoses.parquet              one row per arm: verdict, summary, causes
    reports/arm=A/diagnosis/             diagnosis.json, model.yaml, report.html

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from tempfile import TemporaryDirectory
from typing import Any

from armid_ros import ArmModel, diagnose, identify
from armid_ros.errors import ArmidError, FleetError
from armid_ros.fleet.bags import folder_of
from armid_ros.fleet.plan import document, kind_arm
from armid_ros.fleet.run import RETRIES
from armid_ros.fleet.store import fetched, Store
from armid_ros.fleet.watch import Watch
from armid_ros.identification import Conditioning
from armid_ros.recording import read_recording
from distributed import as_completed, Client
import pyarrow as pa

#: An arm to be diagnosed, with its bags: an entry of ``cases``.
Case = dict[str, Any]
#: Number of bags before a change for the identification, and after it for the diagnosis.
_N_BAGS = 3

DIAGNOSES = pa.schema(
    [
        ('arm', pa.string()),
        ('verdict', pa.string()),  # verdict of the diagnosis, or 'failed'
        ('summary', pa.string()),
        ('effects', pa.list_(pa.string())),  # names of the catalogue, the largest first
        ('closed', pa.float64()),  # share of the gap on data not used to fit
        ('baseline', pa.list_(pa.string())),  # bags
        ('bags', pa.list_(pa.string())),
        ('report', pa.string()),  # path in the results; empty if there is no report
    ]
)


def cases(found: Watch, arms: Sequence[str] = (), everyone: bool = False) -> list[Case]:
    """
    Choose the baseline bags (before the change) and the bags to diagnose (after) of each arm.

    Parameters
    ----------
    found : Watch
        The fleet over time.
    arms : sequence of str
        Names of the arms; by default the arms with a change.
    everyone : bool
        Whether all arms are diagnosed.

    Returns
    -------
    list of dict
        ``arm``, and ``baseline`` and ``bags``: the URLs of its bags before and after its change.
        The last bag is held out for validation.

    Raises
    ------
    FleetError
        If there is no arm of one of these names.

    """
    by_name = {arm.arm: arm for arm in found.arms}
    for name in set(arms) - by_name.keys():
        known = ', '.join(sorted(by_name)[:5])
        raise FleetError(f'--arm {name}: no results of an arm of this name; arms are {known} ...')
    chosen = [by_name[name] for name in arms]
    if not arms:
        chosen = [arm for arm in found.arms if arm.named or everyone]
    some = []
    for arm in chosen:
        urls = [str(row['bag']) for row in arm.bags]
        middle = max(1, len(urls) // 2)
        before, after = urls[:middle], urls[middle:]
        if arm.named and arm.named[0].kind == 'trend':
            before, after = urls[: min(_N_BAGS, middle)], urls[middle:][-_N_BAGS:]
        elif arm.named:
            cut = max(1, urls.index(arm.bag_at(arm.named[0])['bag']))
            before, after = urls[:cut], urls[cut:]
        if len(urls) >= 2:
            some.append({'arm': arm.arm, 'baseline': before[-_N_BAGS:], 'bags': after[:_N_BAGS]})
    return some


def diagnose_fleet(
    client: Client,
    store: Store,
    chosen: Sequence[Case],
    found: Watch,
    report: Callable[[int, int], None] = lambda finished, arms: None,
) -> list[dict[str, Any]]:
    """
    Diagnose arms on a cluster; return and store one row of diagnoses.parquet for each arm.

    Rows of other arms in the table are kept.

    """
    kinds = document(store)['kinds']
    kind_of = {arm.arm: arm.kind for arm in found.arms}
    model_of = {key: kind_arm(store, facts, key) for key, facts in kinds.items()}
    futures = {}
    for case in chosen:
        kind = kind_of[case['arm']]
        facts, model = kinds[kind], model_of[kind]
        filters = Conditioning(**facts['filters'])
        future = client.submit(
            one_arm, case, model, filters, facts['topic'], store.url, retries=RETRIES, pure=False
        )
        futures[future] = case
    rows: list[dict[str, Any]] = []
    for future in as_completed(list(futures), raise_errors=False):
        done = future.status == 'finished'
        found_of_arm = future.result() if done else _failed(future.exception())
        rows.append(futures[future] | found_of_arm)
        report(len(rows), len(futures))
    rows.sort(key=lambda row: str(row['arm']))
    table = store.read_table('watch/diagnoses.parquet')
    new = {row['arm'] for row in rows}
    old = [] if table is None else [row for row in table.to_pylist() if row['arm'] not in new]
    both = pa.Table.from_pylist([*old, *rows], DIAGNOSES)
    store.write_table('watch/diagnoses.parquet', both)
    return rows


def one_arm(
    case: Case, model: ArmModel, filters: Conditioning, topic: str | None, out: str
) -> dict[str, Any]:
    """Dask task: identify an arm from its baseline bags; diagnose its later bags; return a row."""
    store = Store(out)
    try:
        with ExitStack() as stack:
            before, after = (
                [
                    read_recording(
                        stack.enter_context(fetched(url)), joints=model.robot.joints, topic=topic
                    )
                    for url in urls
                ]
                for urls in (case['baseline'], case['bags'])
            )
            past = identify(model, before, cutoff=filters.cutoff_hz, decimation=filters.decimation)
            result = diagnose(
                past.arm,
                after[:2],
                validate=after[2:],
                baseline=before,
                cutoff=filters.cutoff_hz,
                decimation=filters.decimation,
            )
            place = f'reports/{folder_of(str(case["arm"]))}/diagnosis'
            folder = result.save(stack.enter_context(TemporaryDirectory(prefix='armid-report-')))
            # report.html is written last, because pages link to it
            for file in sorted(folder.iterdir(), key=lambda file: file.name == 'report.html'):
                store.write(f'{place}/{file.name}', file.read_bytes())
    except ArmidError as error:
        return _failed(error)
    gap = result.core.gap
    return {
        'verdict': result.verdict,
        'summary': result.core.summary,
        'effects': list(dict.fromkeys(result.names)),
        'closed': None if gap is None else float(gap.closed),
        'report': f'{place}/report.html',
    }


def _failed(error: BaseException | None) -> dict[str, Any]:
    return {
        'verdict': 'failed',
        'summary': str(error),
        'effects': [],
        'closed': None,
        'report': '',
    }
