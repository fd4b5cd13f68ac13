# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The report of a bag, made when somebody asks for it: its own fit with the filters of the fleet.

    reports/arm=A/BAG/    identification.json, model.yaml, report.html

A fleet has far more bags than anybody looks at, so reports are not made with the summaries.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
import tempfile
from typing import Any

from armid_ros.api.identification import identify
from armid_ros.arm import ArmModel
from armid_ros.errors import FleetError
from armid_ros.fleet.bags import BagFile, folder_of
from armid_ros.fleet.identify import kind_arm
from armid_ros.fleet.job import Filters
from armid_ros.fleet.kinds import document
from armid_ros.fleet.store import fetched, Store
from armid_ros.fleet.watch import Watch, WatchedArm
from armid_ros.recording import read_recording, Recording


def asked_bags(found: Watch, arm: str, names: Sequence[str]) -> list[str]:
    """
    Return the URLs of the bags of an arm that reports are wanted of.

    Without names, those beside its change, and the latest one.

    Raises
    ------
    FleetError
        There is no such arm, or no such bag of it.

    """
    by_name = {one.arm: one for one in found.arms}
    if arm not in by_name:
        known = ', '.join(sorted(by_name)[:5])
        raise FleetError(f"there is no arm '{arm}'; there are {known} ...")
    return _named(by_name[arm], names) if names else _usual(by_name[arm])


def write_reports(
    store: Store,
    arm: WatchedArm,
    urls: Sequence[str],
    tell: Callable[[int, int], None] = lambda ended, of: None,
) -> list[str]:
    """Write the reports of some bags of an arm; return their files among the results."""
    facts = document(store)['kinds'][arm.kind]
    model, filters = kind_arm(store, facts, arm.kind), Filters(**facts['filters'])
    written = []
    for url in urls:
        with fetched(url) as path:
            recording = read_recording(path, joints=model.robot.joints, topic=facts['topic'])
            written.append(write_report(store, arm.arm, url, recording, model, filters))
        tell(len(written), len(urls))
    return written


def write_report(
    store: Store, arm: str, url: str, recording: Recording, model: ArmModel, filters: Filters
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


def _named(arm: WatchedArm, names: Sequence[str]) -> list[str]:
    found = []
    for name in names:
        fitting = [str(row['bag']) for row in arm.bags if name in (str(row['bag']), _last(row))]
        if not fitting:
            known = ', '.join(_last(row) for row in arm.bags[-5:])
            raise FleetError(f"{arm.arm}: has no bag '{name}'; the latest are {known}")
        found += fitting
    return list(dict.fromkeys(found))


def _usual(arm: WatchedArm) -> list[str]:
    beside = [arm.bag_at(arm.named[0], offset)['bag'] for offset in (-1, 0)] if arm.named else []
    return list(dict.fromkeys(map(str, [*beside, *(row['bag'] for row in arm.bags[-1:])])))


def _last(row: dict[str, Any]) -> str:
    return str(row['bag']).rstrip('/').rsplit('/', 1)[-1]
