# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify every arm of a fleet: bags in, tables of results out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
import hashlib
import json
from typing import Any
import uuid

from armid_ros.arm import ArmModel
from armid_ros.errors import FleetError
from armid_ros.files import json_text
from armid_ros.files.cells import listed
from armid_ros.fleet.bags import BagFile
from armid_ros.fleet.job import Filters, Job, require_linear
from armid_ros.fleet.kinds import choose_filters, document, Entry, known_filters, SCHEMA
from armid_ros.fleet.run import ArmOutcome, run_fleet
from armid_ros.fleet.store import Store
from armid_ros.fleet.summary import Refused
from armid_ros.identification import SignalSettings
from armid_ros.recording import ReadSettings
from armid_ros.robots import load_robot, robot_from_urdf
from distributed import Client
import numpy as np


@dataclass(frozen=True)
class FleetSettings:
    """
    How a fleet is identified.

    Attributes
    ----------
    effects : str
        What acts beside the rigid bodies; a table of robots may say otherwise.
    gravity : str
        'earth', 'moon' or a vector; a table of robots may say otherwise.
    joints : str
        Driven joints with commas; empty for all but grippers.
    weighted : bool
        Whether joints are weighted by their residuals.
    signals : SignalSettings
        Filters; what is None is chosen from a few bags of each kind of arm, once for all days.
    topic : str or None
        JointState topic.
    resume : bool
        Whether results of earlier runs count where bag and settings are the same.
    seed : int
        Of the states over which base parameters are found.
    reading : ReadSettings
        Checksums and memory.

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


@dataclass(frozen=True)
class FleetOutcome:
    """
    What became of a fleet.

    Attributes
    ----------
    arms : tuple of ArmOutcome
        Every arm.
    filters : dict of str to Filters
        Of every kind of arm, by the name of its robot.

    """

    arms: tuple[ArmOutcome, ...]
    filters: dict[str, Filters]

    @property
    def done(self) -> int:
        """Bags that estimates are made of."""
        return sum(arm.done for arm in self.arms)

    @property
    def found(self) -> int:
        """Of these, those that an earlier run had read."""
        return sum(arm.found for arm in self.arms)

    @property
    def refused(self) -> tuple[Refused, ...]:
        """Bags that are not used."""
        return tuple(sorted((one for a in self.arms for one in a.refused), key=lambda r: r.bag))


def plan_fleet(
    bags: Sequence[BagFile],
    robots: str | Mapping[str, Entry],
    out: str,
    settings: FleetSettings,
) -> dict[str, Job]:
    """
    Say what is to be done for every arm, and write it to fleet.json.

    Parameters
    ----------
    bags : sequence of BagFile
        All bags.
    robots : str or mapping of str to Entry
        The robot of all arms, or that of each.
    out : str
        URL of the results.
    settings : FleetSettings
        Effects and filters.

    Returns
    -------
    dict of str to Job
        That of each arm; arms of one kind share it.

    Raises
    ------
    FleetError
        An arm has no robot, an effect cannot be merged, or no bag of a kind can be read.

    """
    store = Store(out)
    before = document(store)
    jobs = _jobs(bags, robots, store, settings)
    for key, job in {_kind(job.arm): job for job in jobs.values()}.items():
        store.write(f'robots/{key}.urdf', job.arm.robot.urdf)
    store.write('fleet.json', _document(before, jobs, settings))
    return jobs


def identify_fleet(
    client: Client,
    bags: Sequence[BagFile],
    jobs: Mapping[str, Job],
    tell: Callable[[int, int], None] = lambda finished, bags: None,
) -> FleetOutcome:
    """
    Identify every arm of a fleet.

    Parameters
    ----------
    client : distributed.Client
        A cluster.
    bags : sequence of BagFile
        All bags.
    jobs : mapping of str to Job
        What is to be done for every arm.
    tell : callable
        Told how many bags have ended, and how many there are.

    Raises
    ------
    FleetError
        The scheduler was lost.

    """
    outcomes = run_fleet(client, bags, jobs, tell)
    filters = {job.arm.robot.name: job.filters for job in jobs.values()}
    return FleetOutcome(tuple(sorted(outcomes, key=lambda one: one.arm)), filters)


def kind_arm(store: Store, facts: Mapping[str, Any], key: str) -> ArmModel:
    """Return the arm model of a kind that fleet.json has."""
    urdf = store.read(f'robots/{key}.urdf')
    if urdf is None:
        raise FleetError(f'{store.url}/robots/{key}.urdf: there is no such description')
    robot = robot_from_urdf(
        urdf.decode(), gravity=facts['gravity'], joints=facts['joints'], source=facts['robot']
    )
    return ArmModel.of(robot, effects=facts['effects'])


def _jobs(
    bags: Sequence[BagFile],
    robots: str | Mapping[str, Entry],
    store: Store,
    settings: FleetSettings,
) -> dict[str, Job]:
    """Return the job of every arm; arms of one kind share it."""
    entries: dict[str, Entry] = {}
    for arm in dict.fromkeys(bag.arm for bag in bags):
        entry = Entry(robots) if isinstance(robots, str) else robots.get(arm)
        if entry is None:
            some = ', '.join(list(robots)[:5]) + (' ...' if len(robots) > 5 else '')
            raise FleetError(
                f"--robots: arm '{arm}' is not in the table, which has {some}; add a line for it"
            )
        entries[arm] = entry
    known_kinds = known_filters(store)
    run = uuid.uuid4().hex[:12]
    by_entry: dict[Entry, Job] = {}
    for entry in dict.fromkeys(entries.values()):
        model = _model(entry, settings)
        own = [bag for bag in bags if entries[bag.arm] == entry]
        theory = model.base_parameters(np.random.default_rng(settings.seed))
        key = _kind(model)
        asked = settings.signals
        filters = known_kinds.get(key)
        if filters is None or asked != SignalSettings():
            filters = choose_filters(model, theory, own, asked, settings.topic, settings.reading)
        by_entry[entry] = Job(
            model,
            theory,
            filters,
            store.url,
            run,
            settings.weighted,
            settings.topic,
            settings.resume,
            settings.reading,
        )
    return {arm: by_entry[entry] for arm, entry in entries.items()}


def _model(entry: Entry, settings: FleetSettings) -> ArmModel:
    chosen = entry.joints or settings.joints
    robot = load_robot(
        entry.robot,
        gravity=entry.gravity or settings.gravity,
        joints=listed(chosen.replace(';', ',')) if chosen else None,
    )
    model = ArmModel.of(robot, effects=(entry.effects or settings.effects).replace(';', ','))
    require_linear(model, np.random.default_rng(settings.seed))
    return model


def _kind(arm: ArmModel) -> str:
    """Return a name for a robot with its effects."""
    robot = arm.robot
    facts = [robot.urdf, [float(g) for g in robot.gravity], list(robot.joints), _effects(arm)]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:12]


def _effects(arm: ArmModel) -> list[str]:
    return [f'{effect.name}@{"+".join(effect.joints)}' for effect in arm.effects]


def _document(before: dict[str, Any], jobs: Mapping[str, Job], settings: FleetSettings) -> str:
    kinds = dict(before.get('kinds', {}))
    for job in jobs.values():
        robot = job.arm.robot
        kinds[_kind(job.arm)] = {
            'robot': robot.name,
            'gravity': [float(g) for g in robot.gravity],
            'joints': list(robot.joints),
            'effects': _effects(job.arm),
            'method': 'wls' if job.weighted else 'ols',
            'topic': settings.topic,
            'filters': asdict(job.filters),
        }
    arms = {**before.get('arms', {}), **{arm: _kind(job.arm) for arm, job in jobs.items()}}
    return json_text({'schema': SCHEMA, 'kinds': kinds, 'arms': arms}, indent=1)
