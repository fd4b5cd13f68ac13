# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A fleet identified on two processes is what each arm identified alone is."""

from dataclasses import replace
from datetime import datetime, UTC
from pathlib import Path

from armid_ros.arm import ArmModel
from armid_ros.errors import FleetError
from armid_ros.fleet.bags import DAY_NS, find_bags
from armid_ros.fleet.merge import prepare
from armid_ros.fleet.plan import document, Entry, plan_fleet
from armid_ros.fleet.store import Store
from armid_ros.identification import IdentificationSettings, identify, Score, SignalSettings
from armid_ros.recording import read_recording
import duckdb
import numpy as np
import pytest

from docsite.schemas import faults
from tests.golden.simulated_fleet import EFFECTS

from .conftest import identified, SETTINGS, URDF


@pytest.fixture(scope='module')
def done(bags, cluster, tmp_path_factory):
    """Return the outcome of a run over the small fleet, and where its results are."""
    out = tmp_path_factory.mktemp('results')
    told = []
    outcome = identified(
        cluster, find_bags([f'{bags}/*/*']), URDF, str(out), SETTINGS, lambda *n: told.append(n)
    )
    assert told[-1] == (9, 9)
    return outcome, Store(str(out))


def test_the_plan_is_as_its_schema_says(done):
    assert faults('fleet', document(done[1])) == []


def by_arm(table, arm):
    """Return the parameters of an arm, in the order of the table."""
    frame = table.to_pandas()
    return frame[frame['arm'].astype(str) == arm]


def alone(paths, outcome):
    """Return one identification of some bags with the filters of the fleet."""
    (filters,) = outcome.filters.values()
    arm = ArmModel.of(URDF, effects=EFFECTS)
    recordings = [read_recording(path, joints=arm.robot.joints) for path in paths]
    settings = IdentificationSettings('wls', SignalSettings(filters.cutoff_hz, filters.decimation))
    return identify(arm, recordings, settings, rng=np.random.default_rng(0))


def test_an_arm_and_a_bag_are_what_their_own_identification_is(bags, done):
    outcome, store = done
    name = 'arm_0001'
    one = alone(sorted((bags / name).iterdir()), outcome)
    rows = by_arm(store.data_set('arms'), name)
    assert list(rows['name']) == [parameter.name for parameter in one.estimate.parameters]
    np.testing.assert_allclose(rows['value'], one.estimate.values, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(rows['std'], one.estimate.std, rtol=1e-9)
    expected = Score.of(one.training).relative_error_percent
    assert rows['relative_error_percent'].iloc[0] == pytest.approx(expected, rel=1e-9)
    assert rows['condition_number'].iloc[0] == pytest.approx(one.condition_number, rel=1e-9)
    path = bags / name / '2026-01-02'
    one, frame = alone([path], outcome), store.data_set('parameters').to_pandas()
    rows = frame[frame['bag'] == str(path)]
    np.testing.assert_allclose(rows['value'], one.estimate.values, rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(rows['std'], one.estimate.std, rtol=1e-9)


def test_results_are_read_by_others_as_one_partitioned_table(done):
    pattern = f'{done[1].url}/parameters/**/*.parquet'
    query = f"select arm, day from read_parquet('{pattern}', hive_partitioning=true)"
    rows = duckdb.sql(query).fetchall()
    assert len(rows) == 9 * 24 and {arm for arm, _ in rows} == {f'arm_000{k}' for k in range(3)}


def test_a_bag_whose_clock_began_at_zero_is_of_the_day_in_its_path(bags, tmp_path):
    bag = find_bags([f'{bags}/*/*'])[0]
    job = plan_fleet([bag], URDF, str(tmp_path), SETTINGS)[bag.arm]
    stamped, dated = (
        prepare(replace(bag, day=day), job).start_ns for day in (bag.day, '2040-05-06')
    )
    assert datetime.fromtimestamp(1e-9 * dated, UTC).strftime('%F') == '2040-05-06'
    assert (dated - stamped) % DAY_NS == 0


def test_a_run_replaces_its_own_part_and_no_other(bags, cluster, tmp_path):
    everything = find_bags([f'{bags}/*/*'])
    identified(cluster, everything, URDF, str(tmp_path), SETTINGS)
    before = stamps(tmp_path)
    again = [bag for bag in everything if bag.day == '2026-01-02' and bag.arm == 'arm_0002']
    identified(cluster, again, URDF, str(tmp_path), SETTINGS)
    after = stamps(tmp_path)
    assert set(after) == set(before)
    changed = {name for name in after if after[name] != before[name]}
    folder = 'arm=arm_0002/day=2026-01-02'
    assert {name for name in changed if name.startswith(('bags', 'parameters'))} == {
        f'{kind}/{folder}/{again[0].name}.parquet' for kind in ('bags', 'parameters')
    }


def test_resume_does_what_is_left_and_nothing_twice(bags, cluster, tmp_path):
    everything = find_bags([f'{bags}/*/*'])
    some = [bag for bag in everything if (bag.arm, bag.day) != ('arm_0001', '2026-01-03')][:7]
    first = identified(cluster, some, URDF, str(tmp_path), SETTINGS)
    before = stamps(tmp_path)
    resumed = replace(SETTINGS, resume=True)
    second = identified(cluster, everything, URDF, str(tmp_path), resumed)
    after = stamps(tmp_path)
    assert (first.done, second.done, second.found) == (7, 9, 7)
    assert second.filters == first.filters
    assert all(after[name] == before[name] for name in before if name.startswith('bags'))
    assert (
        before['arms/arm=arm_0000/estimate.parquet']
        == (after['arms/arm=arm_0000/estimate.parquet'])
    )


def test_one_more_effect_is_another_kind_and_nothing_of_it_is_found(bags, cluster, tmp_path):
    everything = find_bags([f'{bags}/arm_0000/*'], r'(arm_\d+)')
    identified(cluster, everything, URDF, str(tmp_path), SETTINGS)
    other = replace(SETTINGS, effects=f'{EFFECTS},rotor_inertia', resume=True)
    assert identified(cluster, everything, URDF, str(tmp_path), other).found == 0


def test_each_arm_may_have_a_robot_of_its_own(bags, cluster, tmp_path):
    everything = find_bags([f'{bags}/*/*'])
    table = {
        'arm_0000': Entry(URDF),
        'arm_0001': Entry(URDF, effects='viscous_friction'),
        'arm_0002': Entry(URDF, gravity='moon'),
    }
    identified(cluster, everything, table, str(tmp_path), SETTINGS)
    arms = Store(str(tmp_path)).data_set('arms')
    assert len(by_arm(arms, 'arm_0001')) == len(by_arm(arms, 'arm_0000')) - 6
    assert by_arm(arms, 'arm_0002')['relative_error_percent'].iloc[0] > 5.0


def test_an_effect_that_cannot_be_merged_is_refused_before_anything_is_read(bags, tmp_path):
    settings = replace(SETTINGS, effects='viscous_friction,load_dependent_friction')
    with pytest.raises(FleetError, match='load_dependent_friction'):
        identified(None, find_bags([f'{bags}/*/*']), URDF, str(tmp_path), settings)


def stamps(folder):
    """Return when every table was written, by its name."""
    return {
        str(path.relative_to(folder)): path.stat().st_mtime_ns
        for path in Path(folder).rglob('*.parquet')
    }


def digits(store):
    """Return every number of the estimates of arms and bags."""
    frames = [store.data_set(name).to_pandas() for name in ('arms', 'parameters')]
    return [
        sorted(
            frame[['arm', 'name', 'joint', 'value', 'std']]
            .astype({'arm': str})
            .itertuples(index=False, name=None)
        )
        for frame in frames
    ]
