# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which robot each arm is, and the filters that all bags of one kind of robot go through."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
import csv
from dataclasses import dataclass
import io
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.errors import ArmidError, FleetError
from armid_ros.files import load_json, reading
from armid_ros.fleet.bags import BagFile
from armid_ros.fleet.store import fetched, opened, Store, StoreError
from armid_ros.identification.fitting.held_out import cutoff_of_torques
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.signals import Conditioning, conditioning, SignalSettings
from armid_ros.model import BaseParameters
from armid_ros.recording import ReadSettings, Recording
from armid_ros.recording.reader import read_pieces

SCHEMA = 'armid/fleet/1'
#: Bags that the filters are chosen by, of as many arms where there are.
_CHOSEN_BY = 4
#: Bags that are tried for that, where some cannot be read.
_TRIED = 24
#: Samples of each that are looked at.
_LOOKED_AT = 100_000


@dataclass(frozen=True)
class Entry:
    """
    An arm in the table of robots.

    Attributes
    ----------
    robot : str
        Shipped name, or path of a URDF or xacro.
    gravity, joints, effects : str
        As of `armid identify`; empty where the table has none.

    """

    robot: str
    gravity: str = ''
    joints: str = ''
    effects: str = ''


def read_table(url: str) -> dict[str, Entry]:
    """
    Read a CSV with the columns arm and robot, and if wanted gravity, joints and effects.

    Raises
    ------
    FleetError
        It cannot be read, or a line has no arm or robot.

    """
    filesystem, path = opened(url)
    try:
        text = filesystem.cat_file(path).decode('utf-8-sig')
    except (OSError, UnicodeDecodeError) as error:
        raise FleetError(f'--robots {url}: cannot be read: {error}') from error
    with reading(url, FleetError):
        rows = csv.DictReader(io.StringIO(text), skipinitialspace=True)
        names = rows.fieldnames or []
        if not {'arm', 'robot'} <= set(names):
            raise FleetError(
                f'its first line has to name the columns arm and robot; it has {", ".join(names)}'
            )
        table: dict[str, Entry] = {}
        for number, row in enumerate(rows, start=2):
            arm, robot = (str(row[name] or '').strip() for name in ('arm', 'robot'))
            if not arm or not robot:
                raise FleetError(f'line {number}: has no arm or no robot')
            if arm in table:
                raise FleetError(f'line {number}: arm {arm} is there twice')
            rest = (str(row.get(n) or '').strip() for n in ('gravity', 'joints', 'effects'))
            table[arm] = Entry(robot, *rest)
    return table


def choose_filters(
    arm: ArmModel,
    theory: BaseParameters,
    bags: Sequence[BagFile],
    wanted: SignalSettings,
    topic: str | None,
    settings: ReadSettings,
) -> Conditioning:
    """
    Choose the filters for a kind of arm by a few of its bags.

    They are then those of all bags of all days: estimates through other filters differ by more
    than noise.

    Raises
    ------
    FleetError
        No bag can be read; with the reason of the last one.

    """
    recordings: list[Recording] = []
    problem = 'there is none'
    turns: Counter[str] = Counter()
    order = []
    for bag in bags:  # one of each arm before a second one of any
        turns[bag.arm] += 1
        order.append((turns[bag.arm], bag))
    for _, bag in sorted(order)[:_TRIED]:
        try:
            with fetched(bag.url) as path:
                first = read_pieces(
                    path,
                    joints=arm.robot.joints,
                    topic=topic,
                    samples=_LOOKED_AT,
                    keep=lambda piece: piece.start_ns,
                    settings=settings,
                )
                piece, _ = next(first)
                conditioning([piece], wanted)
                recordings.append(piece)
        except (ArmidError, StoreError) as error:
            problem = str(error)
        if len(recordings) == _CHOSEN_BY:
            break
    if not recordings:
        raise FleetError(f'no bag of {arm.robot.name} can be read: {problem}')
    used = conditioning(recordings, wanted)
    if wanted.cutoff_hz is None:
        repaired, _ = without_damage(recordings, SignalSettings(used.cutoff_hz, used.decimation))
        used = cutoff_of_torques(arm, theory.independent, repaired, used)
    return Conditioning(used.rate_hz, used.cutoff_hz, used.decimation)


def document(store: Store) -> dict[str, Any]:
    """
    Return fleet.json; empty if there is none.

    Raises
    ------
    FleetError
        It is none of this program.

    """
    data = store.read('fleet.json')
    if data is None:
        return {}
    with reading(f'{store.url}/fleet.json', FleetError):
        found: Mapping[str, Any] = load_json(data.decode())
        if found['schema'] != SCHEMA:
            raise FleetError(f'holds {found["schema"]}, not {SCHEMA}; name another folder')
    return dict(found)
