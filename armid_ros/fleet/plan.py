# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The plan of a fleet: which model and filters every arm has, and the file that keeps them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import hashlib
import itertools
import json
from typing import Any
import uuid

from armid_ros.arm import ArmModel
from armid_ros.errors import FleetError
from armid_ros.files import json_text
from armid_ros.files.cells import listed
from armid_ros.fleet.bags import BagFile
from armid_ros.fleet.job import filter_facts, FleetSettings, Job, require_linear
from armid_ros.fleet.kinds import choose_filters, document, Entry, SCHEMA
from armid_ros.fleet.store import Store
from armid_ros.identification import Conditioning, SignalSettings
from armid_ros.robots import load_robot, robot_from_urdf
import numpy as np


def plan_fleet(
    bags: Sequence[BagFile],
    robots: str | Mapping[str, Entry],
    out: str,
    settings: FleetSettings,
) -> dict[str, Job]:
    """
    Plan what is to be done for every arm, and write it to fleet.json.

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
    bags_of: dict[Entry, list[BagFile]] = {}
    for arm, own in itertools.groupby(sorted(bags), key=lambda bag: bag.arm):
        entry = Entry(robots) if isinstance(robots, str) else robots.get(arm)
        if entry is None:
            known = ', '.join(list(robots)[:5]) + (' ...' if len(robots) > 5 else '')
            raise FleetError(
                f"--robots: arm '{arm}' is not in the table, which has {known}; add a line for it"
            )
        bags_of.setdefault(entry, []).extend(own)
    store, run = Store(out), uuid.uuid4().hex[:12]
    before = document(store)
    kinds, arms = dict(before.get('kinds', {})), dict(before.get('arms', {}))
    jobs: dict[str, Job] = {}
    for entry, some in bags_of.items():
        model = _model(entry, settings)
        robot = model.robot
        effects = [f'{effect.name}@{"+".join(effect.joints)}' for effect in model.effects]
        gravity, joints = [float(g) for g in robot.gravity], list(robot.joints)
        facts = json.dumps([robot.urdf, gravity, joints, effects])
        key = hashlib.sha256(facts.encode()).hexdigest()[:12]
        theory = model.base_parameters(np.random.default_rng(settings.seed))
        wanted, topic = settings.signals, settings.topic
        if key in before.get('kinds', {}) and wanted == SignalSettings():
            filters = Conditioning(**before['kinds'][key]['filters'])
        else:
            filters = choose_filters(model, theory, some, wanted, topic, settings.reading)
        job = Job(model, theory, filters, store.url, run, settings)
        store.write(f'robots/{key}.urdf', robot.urdf)
        kinds[key] = {
            'robot': robot.name,
            'gravity': gravity,
            'joints': joints,
            'effects': effects,
            'method': 'wls' if settings.weighted else 'ols',
            'topic': topic,
            'filters': filter_facts(filters),
        }
        for bag in some:
            arms[bag.arm], jobs[bag.arm] = key, job
    text = json_text({'schema': SCHEMA, 'kinds': kinds, 'arms': arms}, indent=1)
    store.write('fleet.json', text)
    return jobs


def kind_arm(store: Store, facts: Mapping[str, Any], key: str) -> ArmModel:
    """Return the arm model of a kind that fleet.json has."""
    urdf = store.read(f'robots/{key}.urdf')
    if urdf is None:
        raise FleetError(f'{store.url}/robots/{key}.urdf: there is no such description')
    robot = robot_from_urdf(
        urdf.decode(), gravity=facts['gravity'], joints=facts['joints'], source=facts['robot']
    )
    return ArmModel.of(robot, effects=facts['effects'])


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
