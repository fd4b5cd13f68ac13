# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What armid identify writes, prints and shows, and what armid compare makes of two of them."""

from dataclasses import replace
import json
from pathlib import Path
import re
import shutil

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


@pytest.mark.parametrize('again', [(), ('--validate',)])
def test_a_recording_is_fitted_once_and_not_held_out_as_well(bags, tmp_path, again):
    arguments = ('identify', bags[0], *again, bags[0], '--robot', ROBOT, '--out', tmp_path / 'o')
    said = armid(*arguments, code=2).stderr
    assert f'given twice, or in two roles: {bags[0]}; give each recording once' in said


def test_a_recording_without_motion_is_not_held_out(bags, tmp_path):
    """Its torque error is of noise, and checks no model."""
    robot = load_robot(ROBOT)
    recording = read_recording(bags[1], joints=robot.joints)
    still = replace(recording, q=np.tile(recording.q[0], (len(recording), 1)), dq=None)
    write_recording(tmp_path / 'still', still)
    out = tmp_path / 'out'
    more = ('--validate', tmp_path / 'still', '--out', out)
    said = armid('identify', bags[0], '--robot', ROBOT, *more, code=2).stderr
    assert 'still: no motion, every joint stays within' in said
    assert not out.exists()


def test_identify_prints_one_screen(bags, tmp_path):
    """A row for each joint with its error and friction; the table of parameters on demand."""
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
    everything = armid(*asked, '--verbose').stdout
    single = [row for row in document['parameters'] if ' ' not in row['name']]
    assert all(row['name'] in everything for row in single)  # sums are wrapped


def test_identify_prints_json_and_nothing_else(bags, tmp_path):
    result = armid('identify', bags[0], '--robot', ROBOT, '--out', tmp_path / 'o', '--json')
    assert json.loads(result.stdout)['robot'] == ROBOT


def test_the_sample_bag_is_the_demo(tmp_path):
    """Recorded over topics; the friction of the shoulder is the demo's 0.1 N m s/rad."""
    bag = Path(__file__).parents[2] / 'bags' / 'humanoid_arm_moon'
    out = tmp_path / 'out'
    armid('identify', bag, '--robot', '-', '--gravity', 'moon', '--out', out)
    document = json.loads((out / 'identification.json').read_text())
    rows = {(row['name'], row['joint']): row for row in document['parameters']}
    viscous = rows['viscous_coefficient', 'shoulder_pitch']
    assert abs(viscous['value'] - 0.1) < max(3 * viscous['std'], 0.002)
    assert document['training']['relative_error_percent'] < 4.0


def test_physical_identifications_are_bodies_and_can_be_compared(bags, tmp_path):
    before, after = tmp_path / 'before', tmp_path / 'after'
    for bag, out in zip(bags, (before, after), strict=True):
        armid('identify', bag, '--robot', ROBOT, '--physical', '--out', out)
    robot = load_robot(before / 'identified.urdf')
    model = load_model(before / 'model.yaml')
    np.testing.assert_allclose(robot.rigid_parameters, model.robot.rigid_parameters, atol=1e-9)
    assert (before / 'identified.mjcf.xml').read_text().startswith('<')
    armid('compare', before, after, '--out', tmp_path / 'compared')
    assert (tmp_path / 'compared' / 'report.html').is_file()


def test_physical_identification_prints_its_certificate_and_its_checks(bags, tmp_path):
    out = tmp_path / 'out'
    arguments = ('--robot', ROBOT, '--physical', '--total-mass', 2.8, '--validate', bags[1])
    box = 'wrist_pitch=-0.1,-0.1,-0.1:0.1,0.1,0.1'
    text = armid('identify', bags[0], *arguments, '--box', box, '--out', out, '--verbose').stdout
    document = json.loads((out / 'identification.json').read_text())
    links = document['physical']['links']
    assert len(links) == 6
    assert min(min(link['eigenvalues']) for link in links) > 0.0
    assert sum(link['mass'] for link in links) == pytest.approx(2.8, rel=1e-6)
    for expected in (
        'eigenvalues of the pseudo-inertia',
        f'{links[0]["eigenvalues"][0]:.3g}',
        'the masses add up to 2.8 kg, as given',
        'identified.urdf has no place for torque_offset',
        'Durbin-Wu-Hausman test',
        'simulated in closed loop',
        'includes 0',
        'not identified: m1',
    ):
        assert expected in text
    (forward,) = document['verification']['forward']
    assert max(forward['after']['position_rms'].values()) < 0.01
    assert document['verification']['encoder_noise']['p_value'] > 0.0
    page = (out / 'report.html').read_text()
    assert 'Physical consistency' in page
    assert 'Forward validation' in page


def test_checks_can_be_left_out(bags, tmp_path):
    out = tmp_path / 'out'
    asked = ('identify', bags[0], '--robot', ROBOT, '--no-verify', '--verbose')
    assert 'check:' not in armid(*asked, '--out', out).stdout
    assert 'verification' not in json.loads((out / 'identification.json').read_text())


def test_a_load_between_two_days_is_said_in_words(tmp_path):
    robot = load_robot(ROBOT)
    arm = ArmModel(robot)
    held = 0.2 * np.array([1.0, 0.0, 0.0, 0.05, 0.004, 0.0, 0.004, 0.0, 0.0, 0.001])
    loaded = arm.with_effect(make_effect('payload', robot), held)
    for name, day, seed in (('before', arm, 0), ('after', loaded, 1)):
        bag = bag_of(tmp_path / f'{name}_bag', day, seed)
        armid('identify', bag, '--robot', ROBOT, '--no-verify', '--out', tmp_path / name)
    days = (tmp_path / 'before', tmp_path / 'after')
    text = armid('compare', *days, '--out', tmp_path / 'compared').stdout
    assert 'kg was added to the link of wrist_pitch' in text
    document = json.loads((tmp_path / 'compared' / 'comparison.json').read_text())
    assert abs(document['load']['mass'] - 0.2) < 3.0 * document['load']['mass_std']
    assert (
        'was added to the link of wrist_pitch'
        in (tmp_path / 'compared' / 'report.html').read_text()
    )


def test_what_one_moving_joint_does_not_tell_is_nowhere_a_number(tmp_path):
    """The elbow alone moves: of the friction of the others nothing is said, and that is said."""
    robot = load_robot(ROBOT)
    arm = ArmModel(robot).with_effect(make_effect('viscous_friction', robot), np.full(6, 0.1))
    bag, out = bag_of(tmp_path / 'bag', arm, 0, moving=3), tmp_path / 'out'
    text = armid('identify', bag, '--robot', ROBOT, '--out', out, '--verbose').stdout
    table, said = text.split('not identified: ')
    document = json.loads((out / 'identification.json').read_text())
    model = yaml.safe_load((out / 'model.yaml').read_text())
    (viscous,) = (e for e in model['effects'] if e['name'] == 'viscous_friction')
    page = (out / 'report.html').read_text()
    unseen = page[page.index('This motion does not show it') :]
    shown = [row['joint'] for row in document['parameters'] if row['name'] == VISCOUS]
    assert shown == ['elbow_pitch']
    assert len(re.findall(rf'{VISCOUS} +elbow_pitch +0\.[0-9]+', table)) == 1
    assert table.count(VISCOUS) == 1
    for joint in set(robot.joints) - {'elbow_pitch'}:
        assert f'{VISCOUS} of {joint}' in said
        assert f'viscous coefficient of {joint}' in unseen
    assert {row['joint'] for row in viscous['parameters'] if row['std'] is not None} == set(shown)


def test_what_is_not_told_from_zero_is_printed_without_a_value(tmp_path):
    """Offsets that the arm does not have."""
    arm = ArmModel(load_robot(ROBOT))
    bag, out = bag_of(tmp_path / 'bag', arm, 0), tmp_path / 'out'
    text = armid('identify', bag, '--robot', ROBOT, '--out', out, '--verbose').stdout
    lines = text.splitlines()
    rows = json.loads((out / 'identification.json').read_text())['not_identified']
    weak = [(r['name'], r['joint']) for r in rows if r['reason'] == 'not told from zero']
    single = [key for key in weak if ' ' not in key[0]]
    assert any(name == 'torque_offset' for name, _ in single)
    for key in single:
        (line,) = (line for line in lines if tuple(line.split()[:2]) == key)
        assert 'includes 0' in line


def test_the_terminal_says_with_what_a_residual_goes(bags, tmp_path):
    """As the page does: friction that the model has not is a residual that goes with speed."""
    asked = ('identify', bags[0], '--validate', bags[1], '--robot', ROBOT, '--no-verify')
    for effects, said in (('torque_offset', True), ('viscous_friction', False)):
        out = tmp_path / effects
        text = armid(*asked, '--effects', effects, '--out', out).stdout
        found = re.findall(r'[a-z_]+: the residual depends on speed \([0-9]+ %\)', text)
        assert bool(found) == said
        page = (out / 'report.html').read_text()
        assert all(sentence in page for sentence in found)


def test_a_folder_with_other_files_is_refused_before_any_work(bags, tmp_path):
    (tmp_path / 'notes.txt').write_text('mine')
    result = armid('identify', bags[0], '--robot', ROBOT, '--out', tmp_path, code=2)
    assert 'holds notes.txt, which this command does not write' in result.output
    assert [path.name for path in tmp_path.iterdir()] == ['notes.txt']


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
    assert 'are of different robots' in text
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
    assert lines[0] == f'unusable: {document["reasons"][0]}'
    page = (out / 'report.html').read_text()
    assert '--gravity moon' in page[: page.index('What was asked</h2>')]
    armid(*arguments, '--strict', code=3)
    armid(*arguments, '--strict', '--json', code=3)
    assert armid(*arguments, '--strict', '--gravity', 'moon').stdout.startswith('good:')


def test_a_joint_without_effort_is_named(tmp_path):
    robot = load_robot(ROBOT)
    bag = bag_of(tmp_path / 'whole', ArmModel(robot), 0)
    recording = read_recording(bag, joints=robot.joints)
    tau = np.array(recording.tau)
    tau[:, 4] = np.nan
    write_recording(tmp_path / 'bag', replace(recording, tau=tau))
    result = armid('identify', tmp_path / 'bag', '--robot', ROBOT, '--out', tmp_path / 'o', code=2)
    assert 'has no effort of forearm_yaw (absent or NaN throughout)' in result.stderr


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


@pytest.mark.parametrize('end', [OutputError('the disk is full'), KeyboardInterrupt()])
def test_a_run_that_fails_leaves_the_result_that_was_there(bags, tmp_path, monkeypatch, end):
    """Model, numbers and page of a folder are those of one run."""

    def fails(*_, **__):
        raise end

    out = tmp_path / 'out'
    armid('identify', bags[0], '--robot', ROBOT, '--physical', '--out', out)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    monkeypatch.setattr('armid_ros.api.identification.write_document', fails)
    code = 2 if isinstance(end, OutputError) else 1
    armid('identify', bags[1], '--robot', ROBOT, '--out', out, code=code)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    monkeypatch.undo()
    armid('identify', bags[1], '--robot', ROBOT, '--out', out)
    assert {path.name for path in out.iterdir()} == {
        'model.yaml',
        'identification.json',
        'report.html',
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
    assert f'drive gain of {found[0]["joint"]}' in done.output
    assert '--effort-scale' in done.output
    for export in document['exports'].values():
        assert export['share'] < 1e-9
    for text in ('b', 'z=1@forearm', 'b=1@nowhere'):
        armid('identify', *bags, '--robot', ROBOT, '--payload', text, '--out', out, code=2)
