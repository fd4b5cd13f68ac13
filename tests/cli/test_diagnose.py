# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid diagnose writes: the verdict, and a motion to run where names are in doubt."""

from itertools import pairwise
import json

from armid_ros.arm import load_model, save_model
from armid_ros.excitation import check_limits, Limits, load_excitation
from armid_ros.model import inverse_dynamics
from armid_ros.recording import write_recording
from armid_ros.robots import collision_model, load_robot
import pytest

from tests.diagnosis.conftest import Bench, URDF

from .conftest import armid


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Return a URDF, a model of the drives, and bags of the arm with a lower link too heavy."""
    bench = Bench()
    folder = tmp_path_factory.mktemp('bench')
    urdf = folder / 'arm.urdf'
    urdf.write_text(URDF, encoding='utf-8')
    robot = bench.robot
    heavy = robot.rigid_parameters.copy()
    heavy[10:14] += [0.1, 0.0, 0.0, 0.01]
    true = robot.with_inertias(heavy)
    weight = bench.recordings(lambda m, _: inverse_dynamics(true, m) - inverse_dynamics(robot, m))
    bags = [folder / f'bag_{k}' for k in range(len(weight))]
    for path, recording in zip(bags, weight, strict=True):
        write_recording(path, recording)
    save_model(folder / 'known.yaml', bench.arm, str(urdf))
    return urdf, folder / 'known.yaml', bags


def test_a_payload_is_never_told_from_its_link_and_the_next_run_says_so(files, tmp_path):
    urdf, model, bags = files
    out = tmp_path / 'out'
    result = armid('diagnose', *bags, '--robot', urdf, '--model', model, '--out', out)
    document = json.loads((out / 'diagnosis.json').read_text())
    assert document['verdict'] == 'ambiguous'
    run = document['next_run']
    excitation = load_excitation(out / run['file'])
    robot = load_robot(str(urdf))
    motion = excitation.motion(100.0)
    assert not check_limits(Limits.of(robot, speed=1.0, torque_fraction=1.0), motion)
    assert collision_model(robot).path_clearance(motion.q).min() > 0.0
    assert run['duration'] == pytest.approx(excitation.duration)
    names = {name for effect in document['effects'] for name in (effect['name'],)}
    assert {pair['name'] for pair in run['separates']} <= names
    twins = [p for p in run['separates'] if {p['name'], p['rival']} == {'payload', 'link_inertia'}]
    assert all(pair['expected_z'] < 1e-3 for pair in twins)
    assert twins
    page = (out / 'report.html').read_text()
    assert run['file'] in page
    assert run['file'] in result.output


def test_nothing_is_to_be_run_where_the_model_is_right(files, tmp_path):
    urdf, _, bags = files
    arm = load_model(files[1], load_robot(str(urdf)))
    heavy = arm.theta.copy()
    heavy[10:14] += [0.1, 0.0, 0.0, 0.01]
    known = tmp_path / 'known.yaml'
    save_model(known, arm.with_theta(heavy), str(urdf))
    out = tmp_path / 'out'
    armid('diagnose', *bags, '--robot', urdf, '--model', known, '--out', out)
    document = json.loads((out / 'diagnosis.json').read_text())
    assert document['verdict'] == 'consistent'
    assert document['next_run'] is None
    assert not (out / 'experiment.yaml').exists()


def test_candidates_say_how_sure_they_are_in_numbers_and_on_the_page(files, tmp_path):
    urdf, model, bags = files
    out = tmp_path / 'out'
    armid('diagnose', *bags, '--robot', urdf, '--model', model, '--out', out)
    document = json.loads((out / 'diagnosis.json').read_text())
    rows = document['candidates']
    assert rows
    assert all(0.0 <= row['adjusted_p'] <= 1.0 and 0.0 <= row['inclusion'] <= 1.0 for row in rows)
    assert all(a['held_out_gain'] >= b['held_out_gain'] for a, b in pairwise(rows))
    page = (out / 'report.html').read_text()
    assert 'Adjusted p' in page
    assert 'Inclusion' in page
