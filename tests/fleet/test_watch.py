# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A fleet over time: who has changed, when and by how much; tables, alarms and pages of it."""

import json
import re

from armid_ros.fleet.bags import find_bags
from armid_ros.fleet.diagnose import cases, diagnose_fleet, DIAGNOSES
from armid_ros.fleet.pages import write_pages
from armid_ros.fleet.store import Store
from armid_ros.fleet.watch import watch_fleet, write_watch
import pyarrow as pa
import pytest

from tests.golden.simulated_fleet import generate

from .conftest import identified, SETTINGS, URDF


@pytest.fixture(scope='module')
def lived(cluster, tmp_path_factory):
    """Return the results of a fleet of which four arms change, each in another way."""
    folder = tmp_path_factory.mktemp('lived')
    generate(folder / 'bags', arms=10, bags=8, changed=4, damaged=1, seconds=15.0, seed=2)
    store = Store(str(folder / 'results'))
    bags = find_bags([f'{folder}/bags/*/*'])
    identified(cluster, bags, URDF, store.url, SETTINGS)
    found = watch_fleet(store)
    write_watch(store, found)
    truth = json.loads((folder / 'bags' / 'truth.json').read_text())
    return store, found, truth


def test_arms_that_changed_are_named_and_no_others(lived):
    _, found, truth = lived
    assert {arm.arm for arm in found.arms if arm.named} == set(truth['arms'])


def test_what_changed_is_said_with_its_day(lived):
    store, _, truth = lived
    rows = store.read_table('watch/changes.parquet').to_pylist()
    for arm, event in truth['arms'].items():
        first = next(row for row in rows if row['arm'] == arm)
        if first['kind'] == 'step':
            assert abs(int(first['first_day'][-2:]) - (event['day'] + 1)) <= 1
        if event['what'] == 'friction':
            assert (first['name'], first['joint']) == (
                'coulomb_torque',
                ['waist', 'shoulder', 'elbow'][event['joint']],
            )
        if event['what'] == 'load':
            assert not first['name'].endswith(('coefficient', 'torque'))
        if event['what'] == 'unmodelled':
            assert first['name'] == 'residual'


def test_alarms_are_the_changes_as_lines_of_json(lived):
    store, _, truth = lived
    lines = [json.loads(line) for line in store.read('alarms.jsonl').decode().splitlines()]
    assert {line['arm'] for line in lines} == set(truth['arms'])
    assert lines == json.loads(
        json.dumps(store.read_table('watch/changes.parquet').to_pylist(), default=str)
    )


def test_pages_lead_from_the_fleet_to_the_arm_to_the_bag(lived):
    store, found, _ = lived
    write_pages(store, found)
    index = store.read('index.html').decode()
    for arm in found.arms:
        page = store.read(f'pages/{arm.arm}.html').decode()
        assert f'pages/{arm.arm}.html' in index
        anchors = set(re.findall(r'href="#([^"]+)"', page))
        assert anchors <= set(re.findall(r'id="([^"]+)"', page))
        assert len(arm.bags) == sum(f'id="2026-01-{day:02d}-' in page for day in range(1, 9))
    for where in re.findall(r'href="pages/([^"#]+)#([^"]+)"', index):
        assert f'id="{where[1]}"' in store.read(f'pages/{where[0]}').decode()
    for text in (index, page):
        assert '://' not in text


def test_the_overview_shows_those_first_that_need_a_person(lived):
    store, found, truth = lived
    write_pages(store, found)
    order = re.findall(r'href="pages/([^"#]+)\.html"', store.read('index.html').decode())
    assert set(order[: len(truth['arms'])]) == set(truth['arms'])


@pytest.mark.long
def test_the_diagnosis_names_what_happened_with_the_arms_own_past_as_baseline(lived, cluster):
    store, found, truth = lived
    arm = next(arm for arm, event in truth['arms'].items() if event['what'] == 'load')
    (case,) = cases(found, [arm])
    assert max(case['baseline']) < min(case['bags'])
    (row,) = diagnose_fleet(cluster, store, [case], found)
    assert (row['verdict'], row['effects']) == ('named', ['payload'])
    assert store.read(row['report']) is not None
    write_pages(store, found)
    page = store.read(f'pages/{arm}.html').decode()
    assert 'Payload' in page and 'diagnosis/report.html' in page


def test_an_arm_whose_diagnosis_found_something_is_not_shown_as_healthy(lived):
    store, found, truth = lived
    arm = next(arm.arm for arm in found.arms if arm.arm not in truth['arms'])
    row = dict.fromkeys(DIAGNOSES.names) | {'arm': arm, 'verdict': 'named', 'report': ''}
    row['summary'] = 'Payload of 0.25 ± 0.01 kg'
    store.write_table('watch/diagnoses.parquet', pa.Table.from_pylist([row], DIAGNOSES))
    write_pages(store, found)
    page, index = (store.read(name).decode() for name in (f'pages/{arm}.html', 'index.html'))
    for text in (page, index):
        assert '0.25 ± 0.01' in text
    assert '>healthy<' not in page and f'fault in {arm}' in index
    changed = store.read(f'pages/{next(iter(truth["arms"]))}.html').decode()
    assert changed.count('<figure class="changed"') == changed.split('<details')[0].count(
        '<figure'
    )
