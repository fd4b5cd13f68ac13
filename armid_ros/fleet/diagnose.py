# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What has happened to the arms that are named: the diagnosis, with the arm's own past as baseline.

The model is what the arm was before its change, identified from its last bags then; the diagnosis
looks at the first bags after it and is judged by one more that it only predicts. Results:

    watch/diagnoses.parquet              one row an arm: verdict, summary, causes
    reports/arm=A/diagnosis/             diagnosis.json, model.yaml, report.html

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from tempfile import TemporaryDirectory
from typing import Any

from armid_ros.api.diagnosis import diagnose
from armid_ros.api.identification import identify
from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError
from armid_ros.fleet.bags import folder_of
from armid_ros.fleet.plan import document, kind_arm
from armid_ros.fleet.run import RETRIES
from armid_ros.fleet.store import fetched, Store
from armid_ros.fleet.watch import arm_of, Watch
from armid_ros.identification import Conditioning
from armid_ros.recording import read_recording
from distributed import as_completed, Client
import pyarrow as pa

#: An arm to be diagnosed, as of ``cases``.
Case = dict[str, Any]
#: Bags before a change that the arm is identified from, and bags after it that are diagnosed.
BEFORE, AFTER = 3, 3

DIAGNOSES = pa.schema(
    [
        ('arm', pa.string()),
        ('verdict', pa.string()),  # of the diagnosis, or failed
        ('summary', pa.string()),
        ('effects', pa.list_(pa.string())),  # names of the catalogue, the largest first
        ('closed', pa.float64()),  # share of the gap on data not used to fit
        ('baseline', pa.list_(pa.string())),  # bags
        ('bags', pa.list_(pa.string())),
        ('report', pa.string()),  # in the results; empty if there is none
    ]
)


def cases(found: Watch, arms: Sequence[str] = (), everyone: bool = False) -> list[Case]:
    """
    Choose the bags by which arms are diagnosed.

    Parameters
    ----------
    found : Watch
        The fleet over time.
    arms : sequence of str
        Which arms; by default those that are named.
    everyone : bool
        Whether all arms are.

    Returns
    -------
    list of dict
        ``arm``, and as ``baseline`` and ``bags`` the URLs of its bags before and after its
        change; of the latter the last one is only predicted.

    Raises
    ------
    FleetError
        An arm is not there.

    """
    chosen = [arm_of(found, name) for name in arms]
    if not arms:
        chosen = [arm for arm in found.arms if arm.named or everyone]
    some = []
    for arm in chosen:
        urls = [str(row['bag']) for row in arm.bags]
        middle = max(1, len(urls) // 2)
        before, after = urls[:middle], urls[middle:]
        if arm.named and arm.named[0].kind == 'trend':
            before, after = urls[: min(BEFORE, middle)], urls[-min(AFTER, len(urls) - middle) :]
        elif arm.named:
            cut = max(1, urls.index(arm.bag_at(arm.named[0])['bag']))
            before, after = urls[:cut], urls[cut:]
        if len(urls) >= 2:
            some.append({'arm': arm.arm, 'baseline': before[-BEFORE:], 'bags': after[:AFTER]})
    return some


def diagnose_fleet(
    client: Client,
    store: Store,
    chosen: Sequence[Case],
    found: Watch,
    tell: Callable[[int, int], None] = lambda ended, of: None,
) -> list[dict[str, Any]]:
    """
    Diagnose arms on a cluster; a row of ``watch/diagnoses.parquet`` each.

    Rows of other arms stay.

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
        tell(len(rows), len(futures))
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
    """Task: identify what an arm was, and diagnose what it is; return what is found of it."""
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
            report = f'reports/{folder_of(str(case["arm"]))}/diagnosis'
            folder = result.save(stack.enter_context(TemporaryDirectory(prefix='armid-report-')))
            # report.html last: it is what the pages link
            for file in sorted(folder.iterdir(), key=lambda file: file.name == 'report.html'):
                store.write(f'{report}/{file.name}', file.read_bytes())
    except ArmidError as error:
        return _failed(error)
    gap = result.core.gap
    return {
        'verdict': result.verdict,
        'summary': result.core.summary,
        'effects': list(dict.fromkeys(result.names)),
        'closed': None if gap is None else float(gap.closed),
        'report': f'{report}/report.html',
    }


def _failed(error: BaseException | None) -> dict[str, Any]:
    return {
        'verdict': 'failed',
        'summary': str(error),
        'effects': [],
        'closed': None,
        'report': '',
    }
