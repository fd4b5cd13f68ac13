# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Plan of the identification of a fleet: robot of each arm, filters and job of each kind of arm.

fleet.json stores the plan, so that later runs use the same filters.

"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
import csv
from dataclasses import dataclass, field
from functools import cached_property
import io
import itertools
import json
from typing import Any
import uuid

from armid_ros import ArmModel, load_robot
from armid_ros.errors import ArmidError, FleetError
from armid_ros.files import json_text, reading
from armid_ros.files.cells import listed
from armid_ros.fleet.bags import BagFile, digest
from armid_ros.fleet.store import fetched, opened, Store, StoreError
from armid_ros.identification import Conditioning, SignalSettings
from armid_ros.identification.fitting.held_out import cutoff_of_torques
from armid_ros.identification.fitting.nonlinear import is_nonlinear
from armid_ros.identification.output import kinematics_digest
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.signals import conditioning
from armid_ros.model import BaseParameters, random_motion
from armid_ros.recording import ReadSettings, Recording
from armid_ros.recording.reader import read_pieces
import numpy as np


@dataclass(frozen=True)
class FleetSettings:
    """
    Settings of the identification of a fleet.

    Attributes
    ----------
    effects : str
        Effects of all arms, unless the table of robots has others.
    gravity : str
        'earth', 'moon' or a vector, unless the table of robots has another value.
    joints : str
        Driven joints, separated by commas; empty for all joints except grippers.
    weighted : bool
        Whether joints are weighted by the standard deviations of their residuals.
    signals : SignalSettings
        Filters; a value of None is chosen from a few bags of each kind of arm, for all days.
    topic : str or None
        Name of the JointState topic.
    resume : bool
        Whether results of earlier runs are reused if bag and settings are the same.
    seed : int
        Seed of the random states with which base parameters are computed.
    reading : ReadSettings
        Settings for checksums and memory.

    """

    effects: str
    gravity: str = 'earth'
    joints: str = ''
    weighted: bool = True
    signals: SignalSettings = field(default_factory=SignalSettings)
    topic: str | None = None
    resume: bool = False
    seed: int = 0
    reading: ReadSettings = field(default_factory=ReadSettings)


def filters_at(filters: Conditioning, rate_hz: float, source: str) -> Conditioning:
    """
    Adapt the filters of a kind of arm to the sampling rate of a recording.

    Raises
    ------
    FleetError
        If the rate is too low for the cut-off.

    """
    if filters.cutoff_hz >= 0.5 * rate_hz:
        raise FleetError(
            f'{source}: {rate_hz:.4g} samples/s are too few for the cut-off of '
            f'{filters.cutoff_hz:.4g} Hz; set a lower cut-off with --cutoff'
        )
    decimation = filters.decimation
    # sampling rates that differ by less than this share are treated as equal
    if abs(rate_hz / filters.rate_hz - 1.0) > 0.02:
        decimation = max(1, round(rate_hz * filters.decimation / filters.rate_hz))
    return Conditioning(rate_hz, filters.cutoff_hz, decimation)


@dataclass(frozen=True)
class Job:
    """
    Arm model, filters and settings for the bags of all arms of the same kind.

    Attributes
    ----------
    arm : ArmModel
        Rigid body and effects.
    theory : BaseParameters
        Parameters that are identifiable with a suitable motion.
    filters : Conditioning
        Filters of all bags of this kind, with cut-off, decimation and sampling rate.
    out : str
        URL of the results.
    run : str
        Name of the run; results of the same run are not computed again.
    settings : FleetSettings
        Settings of the fleet.

    """

    arm: ArmModel
    theory: BaseParameters
    filters: Conditioning
    out: str
    run: str
    settings: FleetSettings

    @cached_property
    def facts(self) -> dict[str, Any]:
        """Settings that determine the results of a bag, in the form of fleet.json."""
        robot, effects = self.arm.robot, self.arm.effects
        return {
            'robot': robot.name,
            'gravity': [float(g) for g in robot.gravity],
            'joints': list(robot.joints),
            'effects': [f'{effect.name}@{"+".join(effect.joints)}' for effect in effects],
            'method': 'wls' if self.settings.weighted else 'ols',
            'topic': self.settings.topic,
            'filters': {
                name: getattr(self.filters, name)
                for name in ('cutoff_hz', 'decimation', 'rate_hz')
            },
        }

    @cached_property
    def digest(self) -> str:
        """Hash of the settings and kinematics that determine the results of a bag."""
        facts = {**self.facts, 'kinematics': kinematics_digest(self.arm.robot)}
        return digest(json.dumps(facts, sort_keys=True))

    @property
    def samples(self) -> int:
        """Number of samples of a bag that are read into memory at once."""
        joints = self.arm.robot.n_joints
        rows = 16_000_000 // (joints * self.theory.rank)  # larger columns are read in pieces
        return min(rows * self.filters.decimation, 1_400_000 // joints)


SCHEMA = 'armid/fleet/1'


@dataclass(frozen=True)
class Entry:
    """
    Robot and settings of one arm in the table of robots (--robots).

    Attributes
    ----------
    robot : str
        Shipped name, or path of a URDF or xacro.
    gravity, joints, effects : str
        As the options of `armid identify`; empty if the table has no value.

    """

    robot: str
    gravity: str = ''
    joints: str = ''
    effects: str = ''


def read_table(url: str) -> dict[str, Entry]:
    """
    Read a CSV file with columns arm and robot, and optional settings of each arm.

    Raises
    ------
    FleetError
        If the file cannot be read, or a line has no arm or robot.

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
                f'the first line has to name the columns arm and robot; it is {", ".join(names)}'
            )
        table: dict[str, Entry] = {}
        for number, row in enumerate(rows, start=2):
            arm, robot = (str(row[name] or '').strip() for name in ('arm', 'robot'))
            if not arm or not robot:
                raise FleetError(f'line {number}: the column arm or robot is empty')
            if arm in table:
                raise FleetError(f'line {number}: arm {arm} appears twice')
            rest = (str(row.get(n) or '').strip() for n in ('gravity', 'joints', 'effects'))
            table[arm] = Entry(robot, *rest)
    return table


def plan_fleet(
    bags: Sequence[BagFile],
    robots: str | Mapping[str, Entry],
    out: str,
    settings: FleetSettings,
) -> dict[str, Job]:
    """
    Choose and return robot, filters and settings of every arm; write fleet.json.

    Parameters
    ----------
    bags : sequence of BagFile
        All bags.
    robots : str or mapping of str to Entry
        The robot of all arms, or a mapping from arms to robots.
    out : str
        URL of the results.
    settings : FleetSettings
        Effects and filters.

    Returns
    -------
    dict of str to Job
        The job of each arm; arms of one kind share a job.

    Raises
    ------
    FleetError
        If an arm has no robot, an effect cannot be merged, or no bag of a kind can be read.

    """
    bags_of: dict[Entry, list[BagFile]] = {}
    for arm, own in itertools.groupby(sorted(bags), key=lambda bag: bag.arm):
        entry = Entry(robots) if isinstance(robots, str) else robots.get(arm)
        if entry is None:
            known = ', '.join(list(robots)[:5]) + (' ...' if len(robots) > 5 else '')
            raise FleetError(
                f"--robots: arm '{arm}' is not in the table, which has {known}; add its line"
            )
        bags_of.setdefault(entry, []).extend(own)
    store, run = Store(out), uuid.uuid4().hex[:12]
    before = document(store)
    kinds, arms = dict(before.get('kinds', {})), dict(before.get('arms', {}))
    jobs: dict[str, Job] = {}
    for entry, some in bags_of.items():
        model = _model(entry, settings)
        effects = [effect.name + '@' + '+'.join(effect.joints) for effect in model.effects]
        robot = model.robot
        facts = [robot.urdf, robot.gravity.tolist(), list(robot.joints), effects]
        key = digest(json.dumps(facts), size=12)
        theory = model.base_parameters(np.random.default_rng(settings.seed))
        if key in before.get('kinds', {}) and settings.signals == SignalSettings():
            filters = Conditioning(**before['kinds'][key]['filters'])
        else:
            filters = choose_filters(model, theory, some, settings)
        job = Job(model, theory, filters, store.url, run, settings)
        store.write(f'robots/{key}.urdf', robot.urdf)
        kinds[key] = job.facts
        for bag in some:
            arms[bag.arm], jobs[bag.arm] = key, job
    text = json_text({'schema': SCHEMA, 'kinds': kinds, 'arms': arms}, indent=1)
    store.write('fleet.json', text)
    return jobs


def kind_arm(store: Store, facts: Mapping[str, Any], key: str) -> ArmModel:
    """Return the model of a kind of arm, from the URDF and `facts` stored under `key`."""
    urdf = store.read(f'robots/{key}.urdf')
    if urdf is None:
        raise FleetError(
            f'{store.url}/robots/{key}.urdf: the robot description is missing; run `armid fleet '
            'identify` again'
        )
    robot = load_robot(urdf.decode(), gravity=facts['gravity'], joints=facts['joints'])
    return ArmModel.of(robot, effects=facts['effects'])


def document(store: Store) -> dict[str, Any]:
    """
    Return the content of fleet.json; an empty mapping if the file does not exist.

    Raises
    ------
    FleetError
        If another program or version wrote the file.

    """
    data = store.read('fleet.json')
    if data is None:
        return {}
    with reading(f'{store.url}/fleet.json', FleetError):
        found: Mapping[str, Any] = json.loads(data.decode())
        if found['schema'] != SCHEMA:
            raise FleetError(
                f'schema {found["schema"]} is not {SCHEMA} of this version; name another --out'
            )
    return dict(found)


def choose_filters(
    arm: ArmModel, theory: BaseParameters, bags: Sequence[BagFile], settings: FleetSettings
) -> Conditioning:
    """
    Choose the cut-off and the decimation of one kind of arm from at most four bags.

    All bags of all days use these filters: with different filters, estimates differ by more than
    noise.

    Raises
    ------
    FleetError
        If no bag can be read; the message gives the reason for the last bag.

    """
    recordings: list[Recording] = []
    problem, wanted = 'there is none', settings.signals
    turns: Counter[str] = Counter()
    order = []
    for bag in bags:  # the first bag of every arm, then the second bags
        turns[bag.arm] += 1
        order.append((turns[bag.arm], bag))
    # four bags are enough; some cannot be read
    for _, bag in sorted(order)[:24]:
        try:
            with fetched(bag.url) as path:
                first = read_pieces(
                    path,
                    joints=arm.robot.joints,
                    topic=settings.topic,
                    samples=100_000,
                    keep=lambda piece: piece.start_ns,
                    settings=settings.reading,
                )
                piece, _ = next(first)
                conditioning([piece], wanted)
                recordings.append(piece)
        except (ArmidError, StoreError) as error:
            problem = str(error)
        if len(recordings) == 4:
            break
    if not recordings:
        raise FleetError(f'no bag of {arm.robot.name} can be read: {problem}')
    used = conditioning(recordings, wanted)
    if wanted.cutoff_hz is None:
        recordings, _ = without_damage(recordings, used)
        used = cutoff_of_torques(arm, theory.independent, recordings, used)
    return Conditioning(used.rate_hz, used.cutoff_hz, used.decimation)


def _model(entry: Entry, settings: FleetSettings) -> ArmModel:
    chosen = entry.joints or settings.joints
    model = ArmModel.of(
        entry.robot,
        effects=(entry.effects or settings.effects).replace(';', ','),
        gravity=entry.gravity or settings.gravity,
        joints=listed(chosen.replace(';', ',')) if chosen else None,
    )
    # raise a FleetError if the torque is not linear in the parameters of an effect
    motion = random_motion(model.robot, np.random.default_rng(settings.seed), 200)
    bare = ArmModel(model.robot)
    for effect in model.effects:
        one = bare.with_effect(effect)
        linear = effect.instantaneous and len(one.theta) > len(bare.theta)
        if linear:
            values = np.clip(0.1, *effect.bounds())
            theta = np.concatenate([1.1 * bare.theta, values])
            linear = not is_nonlinear(one, one.with_theta(theta), [motion])
        if not linear:
            raise FleetError(
                f'--effects {effect.name}: the torque is not linear in its parameters, so bags '
                'cannot be merged; name other effects, or use `armid diagnose` for this effect'
            )
    return model
