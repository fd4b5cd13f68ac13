# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command line: what it writes, prints and refuses."""

import json
from pathlib import Path

from armid_ros.arm import ArmModel, load_model
from armid_ros.cli import main
from armid_ros.cli.commands import COMMANDS
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.excitation import load_excitation
from armid_ros.identification.two_inertia import Accelerometers, read_runs
from armid_ros.motion import Motion
from armid_ros.recording import read_joint_trajectory, read_recording, write_recording
from armid_ros.robots import load_robot
from click.testing import CliRunner
import numpy as np
import pytest

ROBOT = 'humanoid_arm'
PHYSICAL = ('identify', '{bag}', '--robot', ROBOT, '--out', 'o', '--physical')
QUICK = ('--starts', 1, '--iterations', 5)


def armid(*arguments, code=0):
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == code, result.output
    return result


def bag_of(path, arm, seed, duration=20.0):
    """Write what sensors would record of a motion in closed form."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(200 * duration)) / 200.0
    q, dq, ddq = np.zeros((3, len(t), 6))
    for hz, size in ((0.15, 0.5), (0.4, 0.25), (0.9, 0.08)):
        w = 2 * np.pi * hz
        angle = w * t[:, None] + rng.uniform(0, 2 * np.pi, 6)
        q += size * np.sin(angle)
        dq += size * w * np.cos(angle)
        ddq -= size * w * w * np.sin(angle)
    motion = Motion(arm.robot.joints, t, q, dq, ddq)
    noise = 0.01 * rng.normal(size=q.shape)
    measured = motion.with_torque(arm.torque(motion) + noise)
    write_recording(path, measured, robot_description=arm.robot.urdf)
    return path


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('bags')
    arm = ArmModel(load_robot(ROBOT))
    arm = arm.with_effect(make_effect('viscous_friction', arm.robot), np.full(6, 0.1))
    return [bag_of(folder / name, arm, seed) for seed, name in enumerate(('train', 'held_out'))]


@pytest.mark.parametrize('command', COMMANDS)
def test_every_command_explains_itself_with_an_example(command):
    assert 'Example: armid ' in armid(command, '--help').output


def test_robots_and_effects_are_listed_for_people_and_programs():
    assert ROBOT in armid('robots').output
    listed = json.loads(armid('effects', '--json').output)
    assert [row['name'] for row in listed] == list(CATALOGUE)


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
    text = armid('identify', bags[0], *arguments, '--box', box, '--out', out).stdout
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
        'not told from 0',
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
    text = armid('identify', bags[0], '--robot', ROBOT, '--no-verify', '--out', out).stdout
    assert 'check:' not in text
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


def test_excite_simulate_identify_in_three_lines(tmp_path):
    plan, run = tmp_path / 'plan', tmp_path / 'run'
    arguments = ('--robot', ROBOT, '--gravity', 'moon', '--duration', 10, *QUICK)
    armid('excite', *arguments, '--out', plan)
    excitation = load_excitation(plan / 'excitation.yaml')
    np.testing.assert_allclose(excitation.duration, 10.0)
    robot = load_robot(ROBOT, gravity='moon')
    assert read_joint_trajectory(plan / 'trajectory', joints=robot.joints).joints == robot.joints
    effect = 'viscous_friction:viscous_coefficient=0.05'
    arguments = ('--robot', ROBOT, '--gravity', 'moon', '--effect', effect, '--rate', 200)
    trajectory = plan / 'excitation.yaml'
    armid('simulate', *arguments, '--trajectory', trajectory, '--out', run)
    assert len(read_recording(run, joints=robot.joints)) == 2001
    out = tmp_path / 'out'
    armid('identify', run, '--robot', '-', '--gravity', 'moon', '--out', out)
    model = out / 'model.yaml'
    again = tmp_path / 'again'
    armid('simulate', '--robot', ROBOT, '--model', model, '--rate', 200, '--out', again)


def test_a_second_excitation_adds_to_what_a_bag_tells(bags, tmp_path):
    """With the bag, every parameter is predicted to be known better than without."""
    arguments = ('--robot', ROBOT, '--duration', 8, *QUICK, '--json')
    alone = json.loads(armid('excite', *arguments, '--out', tmp_path / 'a').stdout)
    after = armid('excite', *arguments, '--after', bags[0], '--out', tmp_path / 'b').stdout
    assert json.loads(after)['log_det'] > alone['log_det']


def test_speed_classes_come_in_folders_each_as_it_is_alone(tmp_path):
    arguments = ('--robot', ROBOT, '--duration', 8.33, *QUICK, '--json')
    several = armid('excite', *arguments, '--speed', 'slow,0.6', '--out', tmp_path / 'all').stdout
    slow, medium = (json.loads(line) for line in several.splitlines())
    assert (slow['speed'], medium['speed']) == ('slow', 0.6)
    assert max(slow['limits_used']['velocity']) <= 1.0
    for name in ('excitation.yaml', 'excitation.csv', 'excitation.json', 'report.html'):
        assert (tmp_path / 'all' / 'slow' / name).is_file()
    alone = armid('excite', *arguments, '--speed', '0.6', '--out', tmp_path / 'one').stdout
    assert json.loads(alone)['cost'] == medium['cost']
    again = armid('excite', *arguments, '--speed', '0.6', '--out', tmp_path / 'one', code=2)
    assert 'exists already' in again.stderr


def test_a_run_is_designed_to_tell_two_explanations_apart(tmp_path):
    arguments = ('--robot', ROBOT, '--duration', 8, *QUICK, '--criterion', 'T', '--effects', '')
    size = 'quadratic_friction@elbow_pitch:quadratic_coefficient=0.05'
    rival = ('--rival', 'viscous_friction,coulomb_friction')
    armid('excite', *arguments, '--effect', size, *rival, '--out', tmp_path / 'plan')
    assert 'torque that a rival' in (tmp_path / 'plan' / 'report.html').read_text()
    sizeless = ('--effect', 'quadratic_friction', *rival, '--out', tmp_path / 'no')
    assert 'give what it lacks a size' in armid('excite', *arguments, *sizeless, code=2).stderr


@pytest.mark.parametrize(('kind', 'experiments'), [('multisine', 1), ('steps', 2)])
def test_what_shows_springs_is_followed_by_the_elastic_arm(tmp_path, kind, experiments):
    robot, rng = load_robot('two_link_elastic'), ('--seed', 1)
    plan, run = tmp_path / 'plan', tmp_path / 'run'
    armid('excite', '--robot', robot.name, '--kind', kind, '--duration', 7, *rng, '--out', plan)
    armid('simulate', '--robot', robot.name, '--trajectory', plan / 'trajectory', '--out', run)
    runs = read_runs(run, robot, Accelerometers.on(robot, [0.4, 0.4]))
    assert len(runs) == experiments
    if kind == 'multisine':
        assert np.all(runs[0].motor.tau.std(axis=0) > 0.05 * robot.torque_limit)


def test_options_of_a_design_do_not_go_with_steps(tmp_path):
    arguments = ('excite', '--robot', 'two_link_elastic', '--kind', 'steps', '--starts', 3)
    assert '--starts does not go' in armid(*arguments, '--out', tmp_path / 'o', code=2).stderr


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('identify', 'no.mcap', '--robot', ROBOT, '--out', 'o'), 'no.mcap'),
        (('identify', 'no.mcap', '--robot', 'robbie', '--out', 'o'), 'shipped are humanoid_arm'),
        (
            ('identify', '{bag}', '--robot', ROBOT, '--effects', 'stiction', '--out', 'o'),
            'viscous_friction, coulomb_friction',
        ),
        (
            ('identify', '{bag}', '--robot', ROBOT, '--joints', 'elbow', '--out', 'o'),
            'elbow_pitch',
        ),
        (('identify', '{bag}', '--robot', ROBOT, '--topic', '/x', '--out', 'o'), '/joint_states'),
        ((*PHYSICAL, '--box', 'elbow=0,0,0:1,1,1'), 'elbow_pitch'),
        ((*PHYSICAL, '--box', 'elbow_pitch=0:1'), 'JOINT=X,Y,Z:X,Y,Z'),
        ((*PHYSICAL, '--box', 'elbow_pitch=1,1,1:0,0,0'), 'has to be below'),
        ((*PHYSICAL, '--total-mass', -1), 'total mass -1'),
        ((*PHYSICAL, '--total-mass', 'inf'), 'total mass inf'),
        ((*PHYSICAL[:-1], '--total-mass', 1), 'go with --physical'),
        (('simulate', '--robot', ROBOT, '--gravity', 'mars', '--out', 'o'), 'mars'),
        (('simulate', '--robot', ROBOT, '--effect', 'payload:m=1', '--out', 'o'), 'payload_m'),
        (('simulate', '--robot', ROBOT, '--model', 'none.yaml', '--out', 'o'), 'none.yaml'),
        (('simulate', '--robot', ROBOT, '--out', '{bag}'), '{bag}'),
        (('recover', 'no.mcap', '--out', 'o'), 'no.mcap'),
        (('excite', '--robot', ROBOT, '--clearance', '5', '--out', 'o'), 'clearance'),
        (('excite', '--robot', ROBOT, '--focus', 'stiction', '--out', 'o'), 'viscous_friction'),
        (('excite', '--robot', ROBOT, '--focus', 'payload', '--out', 'o'), "'effects'"),
        (('excite', '--robot', ROBOT, '--rival', 'payload', '--out', 'o'), "criterion 'T'"),
        (('excite', '--robot', ROBOT, '--start', '1,2', '--out', 'o'), 'wrist_pitch'),
        (('excite', '--robot', ROBOT, '--duration', '2', '--out', 'o'), 'duration 2 s'),
        (('excite', '--robot', ROBOT, '--speed', '1.5', '--out', 'o'), 'share of the limits'),
    ],
)
def test_bad_input_is_one_line_with_the_answer(arguments, message, bags, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = armid(*(str(a).format(bag=bags[0]) for a in arguments), code=2)
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith('armid: ')
    assert message.format(bag=bags[0]) in lines[0]
    assert not (tmp_path / 'o').exists()
