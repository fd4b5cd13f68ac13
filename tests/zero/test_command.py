# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid zero`: plan, rests of what plays it, and what the commands write and refuse."""

from dataclasses import replace
from functools import partial
import json

import armid_ros as ar
from armid_ros.errors import IdentificationError
from armid_ros.excitation import load_excitation
from armid_ros.identification.known_payload import parse_payload, with_payload
from armid_ros.nodes.parameters.excitation import checked, make_planner, PUBLISHER_PARAMETERS
from armid_ros.recording import write_recording
from armid_ros.zero.command import zero
from armid_ros.zero.rests import find_rests
import numpy as np
import pinocchio as pin
import pytest

from docsite.schemas import faults
from tests.command import run_command
from tests.zero.machine import play, Secret

run = partial(run_command, zero)


@pytest.fixture(scope='module')
def planned(tmp_path_factory):
    """Return the folder of a plan."""
    folder = tmp_path_factory.mktemp('zero') / 'plan'
    plan = ('plan', '--robot', 'humanoid_arm', '--out', folder, '--poses', 6, '--hold', 1.5)
    assert run(*plan).startswith('FIT TO RUN: ')
    return folder


@pytest.fixture(scope='module')
def secret(robot):
    return Secret.draw(robot, np.random.default_rng(1))


@pytest.fixture(scope='module')
def recorded(robot, planned, secret):
    """Return what an arm in MuJoCo records that plays the plan."""
    excitation = load_excitation(planned / 'excitation.yaml')
    return play(robot, excitation, secret, np.random.default_rng(2), rate=100)


def test_the_publisher_takes_the_plan_with_all_its_checks(planned, robot):
    values = {one.name: one.default for one in PUBLISHER_PARAMETERS} | {'robot': 'humanoid_arm'}
    values = {name: () if value == [''] else value for name, value in values.items()}
    planner, _ = make_planner(values.get)
    excitation = load_excitation(planned / 'excitation.yaml')
    assert checked(excitation, planner, 'plan').joints == robot.joints
    quality = json.loads((planned / 'excitation.json').read_text())
    assert faults('excitation_quality', quality) == []


def test_the_arm_is_at_rest_in_each_pose_from_both_sides(recorded):
    rests = find_rests(recorded)
    pairs = np.abs(np.diff(rests.q, axis=0)).max(axis=1) < 0.02
    assert np.count_nonzero(pairs) >= 5
    assert np.mean(rests.dq[:-1][pairs] == -rests.dq[1:][pairs]) > 0.9
    assert np.mean(rests.dq != 0.0) > 0.9


def fitted(folder, *arguments):
    """Return the quantities that a fit finds, by name and joint."""
    run('fit', *arguments, '--robot', 'humanoid_arm', '--out', folder)
    document = json.loads((folder / 'zero.json').read_text())
    assert faults('zero', document) == []
    return {(row['name'], row['joint']): row for row in document['quantities']}


def test_a_fit_finds_what_is_hidden_and_writes_it(tmp_path, robot, recorded, secret):
    write_recording(tmp_path / 'run', recorded)
    rows = fitted(tmp_path / 'zeros', tmp_path / 'run')
    for joint, value in zip(robot.joints, secret.zero, strict=True):
        row = rows['zero', joint]
        assert abs(row['value'] - value) < 1.5 * row['half_width']
    assert rows['mass', '']['value'] == pytest.approx(secret.mass, rel=0.05)
    assert rows['tilt', '']['value'] == pytest.approx(np.degrees(np.hypot(*secret.tilt)), abs=0.3)
    arm = ar.load_model(tmp_path / 'zeros' / 'model.yaml')
    values = {effect.name: v for effect, v in zip(arm.effects, arm.values, strict=True)}
    assert values['payload'][0] == rows['mass', '']['value']
    reading = values['torque_offset'] * (1.0 + values['torque_gain'])
    np.testing.assert_allclose(reading[:2], [rows['zero', j]['value'] for j in robot.joints[:2]])


def weight(robot, q):
    """Return the torque that holds an arm, shape (N, n)."""
    data = robot.model.createData()
    return np.array([pin.computeGeneralizedGravity(robot.model, data, pose) for pose in q])


def test_an_external_torque_has_the_zeros_and_the_tool_of_the_measured_one(
    tmp_path, robot, recorded
):
    """The controller subtracts the described weight, with neither gains nor tilt."""
    write_recording(tmp_path / 'run', recorded)
    estimated = replace(recorded, tau=recorded.tau - weight(robot, recorded.q))
    write_recording(tmp_path / 'external', estimated)
    measured = fitted(tmp_path / 'a', tmp_path / 'run')
    external = fitted(tmp_path / 'b', tmp_path / 'external', '--external')
    for key, row in measured.items():
        assert external[key]['value'] == pytest.approx(row['value'], abs=0.2 * row['half_width'])


def test_a_known_payload_shows_the_gains_of_an_arm_whose_links_are_doubted(
    tmp_path, robot, recorded, secret
):
    _, link, body = parse_payload('loaded=0.5@hand:0,0,0.05')
    true = robot.with_gravity(secret.gravity(robot))
    added = weight(with_payload(true, link, body), recorded.q) - weight(true, recorded.q)
    write_recording(tmp_path / 'run', recorded)
    loaded = replace(recorded, tau=recorded.tau + secret.gain * added)
    write_recording(tmp_path / 'loaded', loaded)
    doubts = '--link-error', 0.1
    alone = fitted(tmp_path / 'a', tmp_path / 'run', *doubts)
    known = 'loaded=0.5@hand:0,0,0.05'
    both = fitted(
        tmp_path / 'b', tmp_path / 'run', tmp_path / 'loaded', '--payload', known, *doubts
    )
    for k, joint in enumerate(robot.joints[:2]):
        row = both['gain', joint]
        assert abs(row['value'] - secret.gain[k]) < 1.5 * row['half_width']
        assert row['half_width'] < 0.5 * alone['gain', joint]['half_width']
    assert both['mass', '']['value'] == pytest.approx(secret.mass, rel=0.1)


def test_a_run_without_rest_and_one_without_effort_are_refused(recorded):
    moving = replace(recorded, q=recorded.q + 0.2 * np.sin(2.0 * recorded.t)[:, np.newaxis])
    with pytest.raises(IdentificationError, match=r'longest rest .* armid zero plan'):
        find_rests(moving)
    for tau in (None, np.zeros_like(recorded.q)):
        with pytest.raises(IdentificationError, match='efforts are missing or constant'):
            find_rests(replace(recorded, tau=tau))
