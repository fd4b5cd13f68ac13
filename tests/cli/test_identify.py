# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid identify writes, prints and shows, and what armid compare makes of two of them."""

from dataclasses import replace
import json
import shutil
from unittest.mock import Mock

from armid_ros.arm import ArmModel, load_misfit, load_model
from armid_ros.effects import make_effect
from armid_ros.errors import OutputError
from armid_ros.recording import read_recording, write_recording
from armid_ros.robots import load_robot
import numpy as np
import pytest
import yaml

from .conftest import armid, bag_of, ROBOT

pytestmark = pytest.mark.slow

VISCOUS = 'viscous_coefficient'


@pytest.mark.parametrize('again', [(), ('--validate',)])
def test_a_recording_is_fitted_once_and_not_held_out_as_well(bags, tmp_path, again):
    arguments = ('identify', bags[0], *again, bags[0], '--robot', ROBOT, '--out', tmp_path / 'o')
    said = armid(*arguments, code=2).stderr
    assert str(bags[0]) in said


def test_a_recording_without_motion_is_not_held_out(bags, tmp_path):
    """Its torque error is of noise, and checks no model."""
    robot = load_robot(ROBOT)
    recording = read_recording(bags[1], joints=robot.joints)
    still = replace(recording, q=np.tile(recording.q[0], (len(recording), 1)), dq=None)
    write_recording(tmp_path / 'still', still)
    out = tmp_path / 'out'
    more = ('--validate', tmp_path / 'still', '--out', out)
    said = armid('identify', bags[0], '--robot', ROBOT, *more, code=2).stderr
    assert str(tmp_path / 'still') in said and 'motion' in said
    assert not out.exists()


def test_identify_prints_one_screen(bags, tmp_path):
    """A row for each joint with its error and friction."""
    robot = load_robot(ROBOT)
    asked = ('identify', bags[0], '--robot', ROBOT, '--out', tmp_path / 'out')
    lines = armid(*asked).stdout.splitlines()
    assert len(lines) <= 7 + robot.n_joints
    document = json.loads((tmp_path / 'out' / 'identification.json').read_text())
    errors = document['training']['joint_relative_error_percent']
    for joint in robot.joints:
        (row,) = (line for line in lines if line.split()[:1] == [joint])
        assert float(row.split()[1]) == pytest.approx(errors[joint], rel=0.05)
        assert row.count('±') == 2


def test_all_prints_a_line_for_every_parameter_and_the_number_of_the_grade(bags, tmp_path):
    asked = ('identify', bags[0], '--robot', ROBOT, '--no-verify')
    every = armid(*asked, '--all', '--out', tmp_path / 'a').stdout.splitlines()
    few = armid(*asked, '--out', tmp_path / 'b').stdout.splitlines()
    document = json.loads((tmp_path / 'b' / 'identification.json').read_text())
    assert len(every) - len(few) == len(document['parameters']) + 1
    errors = document['training']['joint_halves_error_percent']
    assert document['error_percent'] == errors[document['worst_joint']]
    assert f'{document["error_percent"]:.3g} %' in few[0]


def test_links_are_bodies_unless_that_is_refused_or_costs_too_much(bags, tmp_path):
    """Torques of links with negative inertias are those of no bodies."""
    arm = ArmModel(load_robot(ROBOT))
    theta = arm.theta.copy()
    theta[[54, 56, 59]] = -0.2
    impossible = bag_of(tmp_path / 'impossible', arm.with_theta(theta), 3)
    asked = ('--robot', ROBOT, '--no-verify')
    written = {}
    for name, bag, more in (
        ('bodies', bags[0], ()), ('free', bags[0], ('--no-physical',)), ('not', impossible, ())
    ):  # fmt: skip
        armid('identify', bag, *asked, *more, '--out', tmp_path / name)
        written[name] = (tmp_path / name / 'identified.urdf').exists()
    assert written == {'bodies': True, 'free': False, 'not': False}


@pytest.fixture(scope='module')
def physical(bags, tmp_path_factory):
    """Return what armid identify --physical writes of the first bag."""
    out = tmp_path_factory.mktemp('physical') / 'out'
    armid('identify', bags[0], '--robot', ROBOT, '--physical', '--out', out)
    return out


def test_physical_identifications_are_bodies_and_can_be_compared(bags, physical, tmp_path):
    before, after = physical, tmp_path / 'after'
    armid('identify', bags[1], '--robot', ROBOT, '--physical', '--out', after)
    robot = load_robot(before / 'identified.urdf')
    model = load_model(before / 'model.yaml')
    np.testing.assert_allclose(robot.rigid_parameters, model.robot.rigid_parameters, atol=1e-9)
    assert (before / 'identified.mjcf.xml').read_text().startswith('<')
    armid('compare', before, after, '--out', tmp_path / 'compared')
    assert (tmp_path / 'compared' / 'report.html').is_file()


def test_physical_identification_shows_its_certificate_and_its_checks(bags, tmp_path):
    out = tmp_path / 'out'
    arguments = ('--robot', ROBOT, '--physical', '--total-mass', 2.8, '--validate', bags[1])
    box = 'wrist_pitch=-0.1,-0.1,-0.1:0.1,0.1,0.1'
    armid('identify', bags[0], *arguments, '--box', box, '--out', out)
    document = json.loads((out / 'identification.json').read_text())
    links = document['physical']['links']
    assert len(links) == 6
    assert min(min(link['eigenvalues']) for link in links) > 0.0
    assert sum(link['mass'] for link in links) == pytest.approx(2.8, rel=1e-6)
    (forward,) = document['verification']['forward']
    assert max(forward['after']['position_rms'].values()) < 0.01
    assert document['verification']['encoder_noise']['p_value'] > 0.0
    page = (out / 'report.html').read_text()
    facts = (
        f'{links[0]["eigenvalues"][0]:.3g}',
        *('2.8 kg', 'Durbin', 'includes 0', 'Physical consistency', 'Forward validation'),
    )
    assert [fact for fact in facts if fact not in page] == []


def test_what_one_moving_joint_does_not_tell_is_nowhere_a_number(tmp_path):
    """The elbow alone moves: of the friction of the others nothing is said, and that is said."""
    robot = load_robot(ROBOT)
    arm = ArmModel(robot).with_effect(make_effect('viscous_friction', robot), np.full(6, 0.1))
    bag, out = bag_of(tmp_path / 'bag', arm, 0, moving=3), tmp_path / 'out'
    armid('identify', bag, '--robot', ROBOT, '--out', out)
    document = json.loads((out / 'identification.json').read_text())
    model = yaml.safe_load((out / 'model.yaml').read_text())
    (viscous,) = (e for e in model['effects'] if e['name'] == 'viscous_friction')
    page = (out / 'report.html').read_text()
    unseen = page[page.index('This motion does not show it') :]
    shown = [row['joint'] for row in document['parameters'] if row['name'] == VISCOUS]
    assert shown == ['elbow_pitch']
    for joint in set(robot.joints) - {'elbow_pitch'}:
        assert f'of {joint}' in unseen
    assert {row['joint'] for row in viscous['parameters'] if row['std'] is not None} == set(shown)


def test_one_robot_by_two_paths_is_one_and_two_robots_are_refused(bags, tmp_path):
    shutil.copy(load_robot(ROBOT).path, tmp_path / 'here.urdf')
    for name, robot, bag in (('a', ROBOT, bags[0]), ('b', tmp_path / 'here.urdf', bags[1])):
        armid('identify', bag, '--robot', robot, '--no-verify', '--out', tmp_path / name)
    armid('compare', tmp_path / 'a', tmp_path / 'b', '--out', tmp_path / 'compared')
    assert 'different names' not in (tmp_path / 'compared' / 'report.html').read_text()
    document = json.loads((tmp_path / 'b' / 'identification.json').read_text())
    document['description']['kinematics'] = 'another'
    (tmp_path / 'b' / 'identification.json').write_text(json.dumps(document))
    text = armid(
        'compare', tmp_path / 'a', tmp_path / 'b', '--out', tmp_path / 'none', code=2
    ).output
    assert len(text.strip().splitlines()) == 1
    assert not (tmp_path / 'none').exists()


def test_what_a_person_would_stop_at_is_said_first_and_ends_a_strict_run(tmp_path):
    """Recorded on the moon, identified with the gravity of the earth."""
    moon = ArmModel(load_robot(ROBOT, gravity='moon'))
    bag, out = bag_of(tmp_path / 'bag', moon, 0), tmp_path / 'out'
    arguments = ('identify', bag, '--robot', ROBOT, '--no-verify', '--out', out)
    lines = armid(*arguments).stdout.splitlines()
    assert '(0, 0, -1)' in lines[0] and '--gravity moon' in lines[0]
    document = json.loads((out / 'identification.json').read_text())
    assert document['grade'] == 'unusable'
    assert lines[0] == f'UNUSABLE: {document["reasons"][0]}'
    page = (out / 'report.html').read_text()
    assert '--gravity moon' in page[: page.index('</h2>')]
    armid(*arguments, '--strict', code=3)
    assert armid(*arguments, '--strict', '--gravity', 'moon').stdout.startswith('GOOD:')


def test_a_joint_without_effort_is_named(tmp_path):
    robot = load_robot(ROBOT)
    bag = bag_of(tmp_path / 'whole', ArmModel(robot), 0)
    recording = read_recording(bag, joints=robot.joints)
    tau = np.array(recording.tau)
    tau[:, 4] = np.nan
    write_recording(tmp_path / 'bag', replace(recording, tau=tau))
    result = armid('identify', tmp_path / 'bag', '--robot', ROBOT, '--out', tmp_path / 'o', code=2)
    assert 'effort of forearm_yaw' in result.stderr


def test_the_model_file_says_what_the_model_leaves(bags, tmp_path):
    """Of rows in which joints move, of held-out recordings where there are any."""
    out = tmp_path / 'out'
    asked = ['--robot', ROBOT, '--no-verify', '--out', out]
    armid('identify', bags[0], *asked)
    assert load_misfit(out / 'model.yaml').data == 'training'
    armid('identify', bags[0], '--validate', bags[1], *asked)
    misfit = load_misfit(out / 'model.yaml')
    (held_out,) = json.loads((out / 'identification.json').read_text())['validation']
    assert misfit.data == 'held-out'
    assert misfit.rms == pytest.approx(held_out['rms'], rel=0.2)
    whole = held_out['relative_error_percent']
    assert misfit.relative_error_percent == pytest.approx(whole, rel=0.2)


def test_a_run_that_fails_leaves_the_result_that_was_there(bags, physical, tmp_path, monkeypatch):
    """Model, numbers and page of a folder are those of one run."""
    out = shutil.copytree(physical, tmp_path / 'out')
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    for code, end in ((2, OutputError('the disk is full')), (130, KeyboardInterrupt())):
        with monkeypatch.context() as patch:
            fails = Mock(side_effect=end)
            patch.setattr('armid_ros.api.identification.write_document', fails)
            armid('identify', bags[1], '--robot', ROBOT, '--no-verify', '--out', out, code=code)
        assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    armid('identify', bags[1], '--robot', ROBOT, '--out', out)
    assert {path.name for path in out.iterdir()} == {
        'model.yaml',
        'identification.json',
        'report.html',
        'identified.urdf',
        'identified.mjcf.xml',
    }


def test_a_known_payload_fixes_the_gains_of_the_drives(tmp_path):
    arm = ArmModel(load_robot(ROBOT))
    gains = 1.0 + np.array([0.05, 0.08, 0.1, 0.06, 0.09, 0.07])
    gain = make_effect('torque_gain', arm.robot)
    payload = np.concatenate([[1.0], np.zeros(9)])
    loaded = arm.with_effect(make_effect('payload', arm.robot), payload)
    bags = [
        bag_of(tmp_path / name, one.with_effect(gain, gains - 1.0), seed)
        for seed, (name, one) in enumerate((('a', arm), ('b', loaded)))
    ]
    link, out = arm.robot.links[-1], tmp_path / 'out'
    done = armid(
        'identify', *bags, '--robot', ROBOT, '--payload', f'b=1.0@{link}', '--out', out,
        '--physical', '--no-verify',
    )  # fmt: skip
    document = json.loads((out / 'identification.json').read_text())
    rows = {row['joint']: row for row in document['drive_gains']}
    found = [row for row in rows.values() if row['gain'] is not None]
    assert len(found) >= 4
    for joint, wanted in zip(arm.robot.joints, gains, strict=True):
        if rows[joint]['gain'] is not None:
            lower, upper = rows[joint]['interval']
            assert lower - 0.01 < wanted < upper + 0.01
    assert f'of {found[0]["joint"]}' in done.output and '--effort-scale' in done.output
    for export in document['exports'].values():
        assert export['share'] < 1e-9
    for text in ('b', 'z=1@forearm', 'b=1@nowhere'):
        armid('identify', *bags, '--robot', ROBOT, '--payload', text, '--out', out, code=2)


def test_identify_writes_model_numbers_and_page(bags, tmp_path):
    out = tmp_path / 'out'
    result = armid('identify', bags[0], '--robot', '-', '--validate', bags[1], '--out', out)
    assert 'held out' in result.output
    document = json.loads((out / 'identification.json').read_text())
    assert document['schema'] == 'armid/identification/1'
    assert document['validation'][0]['relative_error_percent'] < 3.0
    assert {'name', 'joint', 'value', 'std', 'unit'} == set(document['parameters'][0])
    arm = load_model(out / 'model.yaml')  # its robot came with the bag and lies beside it
    viscous = arm.values[arm.effects.index(make_effect('viscous_friction', arm.robot))]
    np.testing.assert_allclose(viscous, 0.1, atol=0.01)
    assert (out / 'report.html').stat().st_size > 10_000


def test_checks_can_be_left_out(bags, tmp_path):
    out = tmp_path / 'out'
    asked = ('identify', bags[0], '--robot', ROBOT, '--no-verify')
    assert 'check:' not in armid(*asked, '--out', out).stdout
    assert 'verification' not in json.loads((out / 'identification.json').read_text())
