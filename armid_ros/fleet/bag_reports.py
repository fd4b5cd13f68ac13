# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The report of a bag, made on demand: its own fit with the filters of the fleet.

    reports/arm=A/BAG/    identification.json, model.yaml, report.html

A fleet has far more bags than anybody looks at, so reports are not made with the summaries.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
import tempfile

from armid_ros.api.identification import identify
from armid_ros.arm import ArmModel
from armid_ros.errors import FleetError
from armid_ros.fleet.bags import BagFile, folder_of
from armid_ros.fleet.kinds import document
from armid_ros.fleet.plan import kind_arm
from armid_ros.fleet.store import fetched, Store
from armid_ros.fleet.watch import arm_of, Watch, WatchedArm
from armid_ros.identification import Conditioning
from armid_ros.recording import read_recording, Recording


def bags_to_report(found: Watch, name: str, bags: Sequence[str]) -> tuple[WatchedArm, list[str]]:
    """
    Return an arm, and the URLs of its bags that reports are wanted of.

    Without names of bags, those around its change, and the latest one.

    Raises
    ------
    FleetError
        There is no such arm, or no such bag of it.

    """
    arm = arm_of(found, name)
    urls = [str(row['bag']) for row in arm.bags]
    short = [url.rstrip('/').rsplit('/', 1)[-1] for url in urls]
    chosen = []
    for bag in bags:
        fitting = [url for url, last in zip(urls, short, strict=True) if bag in (url, last)]
        if not fitting:
            known = ', '.join(short[-5:])
            raise FleetError(f"{arm.arm}: has no bag '{bag}'; the latest are {known}")
        chosen += fitting
    if not bags:
        around = [str(arm.bag_at(change, k)['bag']) for change in arm.named[:1] for k in (-1, 0)]
        chosen = [*around, *urls[-1:]]
    return arm, list(dict.fromkeys(chosen))


def write_reports(
    store: Store,
    arm: WatchedArm,
    urls: Sequence[str],
    tell: Callable[[int, int], None] = lambda ended, of: None,
) -> list[str]:
    """Write the reports of some bags of an arm; return their files among the results."""
    facts = document(store)['kinds'][arm.kind]
    model, filters = kind_arm(store, facts, arm.kind), Conditioning(**facts['filters'])
    written = []
    for url in urls:
        with fetched(url) as path:
            recording = read_recording(path, joints=model.robot.joints, topic=facts['topic'])
            written.append(write_report(store, arm.arm, url, recording, model, filters))
        tell(len(written), len(urls))
    return written


def write_report(
    store: Store, arm: str, url: str, recording: Recording, model: ArmModel, filters: Conditioning
) -> str:
    """Write the report of one bag; return its file among the results."""
    one = identify(model, recording, cutoff=filters.cutoff_hz, decimation=filters.decimation)
    folder = f'reports/{folder_of(arm)}/{BagFile(arm, url).name}'
    keep(store, one.save, folder)
    return f'{folder}/report.html'


def keep(store: Store, save: Callable[[str], Path], name: str) -> None:
    """Put the files that a result saves among the results, report.html last."""
    with tempfile.TemporaryDirectory(prefix='armid-report-') as folder:
        save(folder)
        files = sorted(Path(folder).iterdir(), key=lambda file: file.name == 'report.html')
        for file in files:
            store.write(f'{name}/{file.name}', file.read_bytes())
