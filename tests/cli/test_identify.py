# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid identify writes, prints and refuses."""

from dataclasses import replace
import json
import shutil
from unittest.mock import Mock

from armid_ros.arm import ArmModel, load_misfit
from armid_ros.effects import make_effect
from armid_ros.errors import OutputError
from armid_ros.recording import read_recording, write_recording
from armid_ros.robots import load_robot
import numpy as np
import pytest

from .conftest import armid, bag_of, ROBOT

pytestmark = pytest.mark.slow

QUICK = ('--no-physical', '--no-verify')


def document_of(folder):
    return json.loads((folder / 'identification.json').read_text())


@pytest.fixture(scope='module')
def made(bags, tmp_path_factory):
    """Return the folder and the text of a fit among bodies, verified with a held-out bag."""
    out = tmp_path_factory.mktemp('made') / 'out'
    box = 'wrist_pitch=-0.1,-0.1,-0.1:0.1,0.1,0.1'
    bodies = ('--physical', '--total-mass', 2.8, '--box', box)
    asked = ('identify', bags[0], '--robot', '-', '--validate', bags[1], *bodies, '--out', out)
    return out, armid(*asked).stdout


@pytest.fixture(scope='module')
def quick(bags, tmp_path_factory):
    """Return the folder of an identification without checks, after all parameters are printed."""
    out = tmp_path_factory.mktemp('quick') / 'out'
    done = armid('identify', bags[0], '--robot', ROBOT, '--no-verify', '--all', '--out', out)
    assert done.stdout.count('±') >= len(document_of(out)['parameters'])
    return out


@pytest.mark.parametrize('again', [(), ('--validate',)])
def test_a_recording_is_fitted_once_and_not_held_out_as_well(bags, tmp_path, again):
    arguments = ('identify', bags[0], *again, bags[0], '--robot', ROBOT, '--out', tmp_path / 'o')
    assert str(bags[0]) in armid(*arguments, code=2).stderr


def test_a_recording_without_motion_is_not_held_out(bags, tmp_path):
    """Its torque error is of noise, and checks no model."""
    recording = read_recording(bags[1], joints=load_robot(ROBOT).joints)
    still = replace(recording, q=np.tile(recording.q[0], (len(recording), 1)), dq=None)
    write_recording(tmp_path / 'still', still)
    more = ('--validate', tmp_path / 'still', '--out', tmp_path / 'out')
    said = armid('identify', bags[0], '--robot', ROBOT, *more, code=2).stderr
    assert str(tmp_path / 'still') in said and 'does not move' in said
    assert not (tmp_path / 'out').exists()


def test_a_row_for_each_joint_fits_on_one_screen(made):
    out, text = made
    lines = text.splitlines()
    assert len(lines) <= 24
    (held_out,) = document_of(out)['validation']
    for joint, error in held_out['joint_relative_error_percent'].items():
        (row,) = (line for line in lines if line.split()[:1] == [joint])
        assert float(row.split()[1]) == pytest.approx(error, rel=0.05)
        assert row.count('±') == 2


def test_links_are_bodies_unless_that_costs_too_much(quick, tmp_path):
    """Torques of links with negative inertias are those of no bodies."""
    arm = ArmModel(load_robot(ROBOT))
    theta = arm.theta.copy()
    theta[[54, 56, 59]] = -0.2
    impossible = bag_of(tmp_path / 'impossible', arm.with_theta(theta), 3)
    armid('identify', impossible, '--robot', ROBOT, '--no-verify', '--out', tmp_path / 'not')
    assert (quick / 'identified.urdf').exists()
    assert not (tmp_path / 'not' / 'identified.urdf').exists()


def test_gravity_of_another_body_is_said_first_and_ends_a_strict_run(tmp_path):
    """Recorded on the moon, identified with the gravity of the earth."""
    moon = ArmModel(load_robot(ROBOT, gravity='moon'))
    bag, out = bag_of(tmp_path / 'bag', moon, 0), tmp_path / 'out'
    arguments = ('identify', bag, '--robot', ROBOT, *QUICK, '--strict', '--out', out)
    first = armid(*arguments, code=3).stdout.splitlines()[0]
    document = document_of(out)
    assert document['grade'] == 'unusable'
    assert first == f'UNUSABLE: {document["reasons"][0]}'
    page = (out / 'report.html').read_text()
    for text in (first, page[: page.index('</h2>')]):
        assert '--gravity moon' in text
    assert armid(*arguments, '--gravity', 'moon').stdout.startswith('GOOD:')


def test_the_model_file_holds_the_residual_of_held_out_data_where_there_are_any(made, quick):
    assert load_misfit(quick / 'model.yaml').data == 'training'
    misfit = load_misfit(made[0] / 'model.yaml')
    (held_out,) = document_of(made[0])['validation']
    assert misfit.data == 'held-out'
    assert misfit.rms == pytest.approx(held_out['rms'], rel=0.2)
    whole = held_out['relative_error_percent']
    assert misfit.relative_error_percent == pytest.approx(whole, rel=0.2)


def test_a_run_that_fails_leaves_the_result_that_was_there(bags, quick, tmp_path, monkeypatch):
    """Model, numbers and page of a folder are those of one run."""
    out = shutil.copytree(quick, tmp_path / 'out')
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    asked = ('identify', bags[1], '--robot', ROBOT, *QUICK, '--out', out)
    for code, end in ((2, OutputError('the disk is full')), (130, KeyboardInterrupt())):
        with monkeypatch.context() as patch:
            fails = Mock(side_effect=end)
            patch.setattr('armid_ros.api.identification.write_document', fails)
            armid(*asked, code=code)
        assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    armid(*asked)
    assert {path.name for path in out.iterdir()} == set(before) - {
        'identified.urdf',
        'identified.mjcf.xml',
    }


def test_a_known_payload_fixes_the_gains_of_the_drives(tmp_path):
    arm = ArmModel(load_robot(ROBOT))
    payload = np.concatenate([[1.0], np.zeros(9)])
    loaded = arm.with_effect(make_effect('payload', arm.robot), payload)
    gain = make_effect('torque_gain', arm.robot)
    bags = [
        bag_of(tmp_path / name, one.with_effect(gain, np.full(6, 0.08)), seed)
        for seed, (name, one) in enumerate((('a', arm), ('b', loaded)))
    ]
    asked = ('identify', *bags, '--robot', ROBOT, *QUICK, '--out', tmp_path / 'out')
    done = armid(*asked, '--payload', f'b=1.0@{arm.robot.links[-1]}')
    rows = [row for row in document_of(tmp_path / 'out')['drive_gains'] if row['gain'] is not None]
    assert len(rows) >= 4
    for row in rows:
        assert row['interval'][0] - 0.01 < 1.08 < row['interval'][1] + 0.01
    assert rows[0]['joint'] in done.output and '--effort-scale' in done.output
    armid(*asked, '--payload', 'b', code=2)
