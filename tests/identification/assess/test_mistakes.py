# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mistakes of recordings are found and named; recordings without any are left in peace."""

from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.assess.hypotheses import (
    delayed,
    hypotheses,
    in_unit,
    known_gravity,
    other_gravity,
)
from armid_ros.identification.assess.mistakes import find_mistake
from armid_ros.identification.rows.checks import unit_of
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.motion import Motion
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot, robot_from_urdf
import numpy as np
import pytest

from benchmarks import real_recordings

from ..conftest import FRICTION, multisine, recorded

RATE = 100.0


def gantry():
    """Return a description with a slide that carries an arm whose last joints are light."""
    links = (
        ('carriage', 6.0, '0.01 0 0.05', 0.05, 'floor', 'prismatic', '0 0 1', 0.6),
        ('boom', 3.2, '0.02 0.01 0.18', 0.045, 'carriage', 'revolute', '0 1 0', 0.1),
        ('arm', 2.1, '0 0.015 0.14', 0.02, 'boom', 'revolute', '0 1 0', 0.38),
        ('wrist', 0.9, '0 0.004 0.04', 0.002, 'arm', 'revolute', '0 0 1', 0.3),
        ('hand', 0.5, '0.004 0 0.05', 0.0009, 'wrist', 'revolute', '1 0 0', 0.08),
    )
    text = '<robot name="gantry"><link name="floor"/>'
    joints = ('lift', 'shoulder', 'elbow', 'turn', 'roll')
    for joint, (link, mass, centre, inertia, parent, kind, axis, z) in zip(
        joints, links, strict=True
    ):
        text += (
            f'<link name="{link}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>'
            f'<inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" '
            f'izz="{inertia}"/></inertial></link><joint name="{joint}" type="{kind}">'
            f'<parent link="{parent}"/><child link="{link}"/><origin xyz="0 0 {z}"/>'
            f'<axis xyz="{axis}"/><limit lower="-2" upper="2" velocity="3" effort="50"/></joint>'
        )
    return text + '</robot>'


GANTRY = gantry()


def recording_of(robot, seed, gravity=None, duration=20.0, friction=1.0):
    """Record an arm whose links are up to a fifth lighter or heavier than described."""
    rng = np.random.default_rng(seed)
    body = robot if gravity is None else robot.with_gravity(gravity)
    links = body.rigid_parameters.reshape(-1, 10) * rng.uniform(0.8, 1.2, (robot.n_joints, 1))
    arm = ArmModel(body.with_inertias(links.ravel()))
    for name, value in FRICTION.items():
        arm = arm.with_effect(make_effect(name, robot), friction * np.full(robot.n_joints, value))
    motion = multisine(robot.joints, duration, RATE, seed=100 + seed, base_hz=0.12)
    exact = recorded(arm, motion)
    noise = 0.02 * np.sqrt(np.mean(exact.tau**2, axis=0)) * rng.normal(size=exact.tau.shape)
    return replace(exact, tau=exact.tau + noise)


def mistake_in(robot, recording):
    """Return what is said of a recording; nothing if nothing is."""
    used = conditioning([recording], SignalSettings())
    found = find_mistake(robot, recording, used)
    return '' if found is None else found.sentence(robot)


def with_column(values, joint, change):
    """Change one column."""
    changed = np.array(values)
    changed[:, joint] = change(changed[:, joint])
    return changed


def exchanged(values, first, second):
    """Exchange two columns."""
    order = np.arange(values.shape[1])
    order[[first, second]] = second, first
    return values[:, order]


def late(recording, samples):
    """Report every torque some samples after its position; before it, if negative."""
    count = len(recording.t) - abs(samples)
    early, after = slice(0, count), slice(abs(samples), None)
    positions, torques = (after, early) if samples > 0 else (early, after)
    q, tau = recording.q[positions], recording.tau[torques]
    return replace(recording, t=recording.t[:count], q=q, dq=None, tau=tau)


@pytest.fixture(scope='module')
def robot():
    return load_robot('humanoid_arm')


@pytest.fixture(scope='module')
def sound(robot):
    return recording_of(robot, 1)


def test_a_sound_recording_has_no_mistake(robot, sound):
    assert mistake_in(robot, sound) == ''


@pytest.mark.parametrize('name', ['humanoid_arm', 'ur10', 'panda'])
@pytest.mark.parametrize('seed', range(4))
def test_recordings_of_arms_drawn_at_random_have_none(name, seed):
    paths = {
        'ur10': 'ur_description/urdf/ur10_robot.urdf',
        'panda': 'panda_description/urdf/panda.urdf',
    }
    source = str(real_recordings.example_robot(paths[name])) if name in paths else name
    robot = load_robot(source)
    assert mistake_in(robot, recording_of(robot, seed)) == ''


def dwelling(joints, count, seed):
    """Return a motion from pose to pose with dwells, 40 s of 100 samples a second."""
    rng = np.random.default_rng(seed)
    t = np.arange(4000) / RATE
    poses = rng.uniform(-1.0, 1.0, (11, count))
    leg, share = np.divmod(t, 4.0)
    s = np.clip(share / 2.5, 0.0, 1.0)[:, np.newaxis]
    step = 10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5
    begin = poses[leg.astype(int)]
    q = begin + (poses[leg.astype(int) + 1] - begin) * step
    dq = np.gradient(q, t, axis=0)
    return Motion(joints, t, q, dq, np.gradient(dq, t, axis=0))


def bristles(motion, give):
    """Return friction of 1 N m that gives way elastically before it slips, shape (N, n)."""
    bent = np.zeros_like(motion.q)
    for k in range(1, len(bent)):
        bent[k] = np.clip(bent[k - 1] + motion.q[k] - motion.q[k - 1], -give, give)
    return bent / give


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(8))
def test_friction_that_gives_way_before_it_slips_is_no_late_torque(robot, seed):
    links = robot.rigid_parameters.reshape(-1, 10)
    links = links * np.random.default_rng(seed).uniform(0.9, 1.1, (robot.n_joints, 1))
    arm = ArmModel(robot.with_inertias(links.ravel()))
    motion = dwelling(robot.joints, robot.n_joints, seed)
    exact = recorded(arm, motion, seed, position_noise=1e-5)
    size = 0.3 * np.sqrt(np.mean(exact.tau**2, axis=0))
    friction = size * (bristles(motion, 2e-4) + 0.3 * motion.dq)
    assert mistake_in(robot, replace(exact, tau=exact.tau + friction)) == ''
    assert ' ms later' in mistake_in(robot, late(replace(exact, tau=exact.tau + friction), 10))


@pytest.mark.parametrize('alone', [0, 1, 2, 3])
@pytest.mark.parametrize('seed', range(3))
def test_a_joint_that_rests_in_all_that_was_fitted_has_none(robot, alone, seed):
    links = robot.rigid_parameters * np.random.default_rng(seed).uniform(0.9, 1.1)
    arm = ArmModel(robot.with_inertias(links))
    for name, value in FRICTION.items():
        arm = arm.with_effect(make_effect(name, robot), np.full(robot.n_joints, value))
    motion = multisine(robot.joints, 40.0, RATE, seed=seed, base_hz=0.12)
    moving = np.clip((motion.t - 20.0) / 4.0, 0.0, 1.0)
    step = 0.8 * (10.0 * moving**3 - 15.0 * moving**4 + 6.0 * moving**5)
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    q[:, alone] = step
    dq[:, alone] = np.gradient(step, motion.t)
    ddq[:, alone] = np.gradient(dq[:, alone], motion.t)
    exact = recorded(arm, replace(motion, q=q, dq=dq, ddq=ddq), seed, position_noise=2e-5)
    noise = 0.02 * np.sqrt(np.mean(exact.tau**2, axis=0))
    rng = np.random.default_rng(seed)
    noisy = exact.tau + noise * rng.normal(size=exact.tau.shape)
    assert mistake_in(robot, replace(exact, tau=noisy)) == ''


@pytest.mark.parametrize('joint', [0, 1, 2, 3])
@pytest.mark.parametrize(
    ('q', 'tau', 'expected'),
    [
        (-1.0, 1.0, 'the position of {} seems to have the opposite sign'),
        (-1.0, -1.0, 'position and torque of {} seem to have the opposite sign'),
        (1.0, 1e3, 'the torque of {} seems to be in N mm instead of N m'),
        (1.0, 1e2, 'the torque of {} seems to be in N cm instead of N m'),
        (1.0, 1e-3, 'the torque of {} seems to be in kN m instead of N m'),
        (np.rad2deg(1.0), 1.0, 'the position of {} seems to be in degrees'),
    ],
)
def test_sign_and_unit_of_one_joint(robot, sound, joint, q, tau, expected):
    wrong = replace(
        sound,
        q=with_column(sound.q, joint, lambda values: q * values),
        tau=with_column(sound.tau, joint, lambda values: tau * values),
    )
    said = mistake_in(robot, wrong)
    assert expected.format(robot.joints[joint]) in said
    assert 'degrees' not in expected or ', or ' not in said


@pytest.mark.slow
@pytest.mark.parametrize('joint', [0, 1, 2, 3])
@pytest.mark.parametrize('degrees', [-90.0, 90.0, 180.0])
def test_a_zero_that_is_off(robot, sound, joint, degrees):
    off = replace(sound, q=with_column(sound.q, joint, lambda q: q + np.deg2rad(degrees)))
    said = mistake_in(robot, off)
    assert f'the zero of {robot.joints[joint]} seems to be off by about {degrees:.0f} ' in said


@pytest.mark.parametrize(
    ('vector', 'believed'),
    [
        ((0.0, 0.0, -14.3), False),
        ((0.0, 0.0, -6.0), False),
        ((0.0, 0.0, -1.62), True),
        ((0.0, 0.0, -3.71), True),
        ((0.0, 3.4, -9.2), True),
        ((0.0, 5.0, -13.4), True),
        ((0.0, 0.0, 9.81), True),
    ],
)
def test_weight_half_as_much_again_is_of_masses_and_not_of_gravity(robot, vector, believed):
    assert (other_gravity(robot, np.array(vector)) is not None) is believed


@pytest.mark.parametrize('pair', [(0, 1), (1, 2), (2, 3), (0, 3)])
@pytest.mark.parametrize('what', ['position and torque', 'position'])
def test_exchanged_joints(robot, sound, pair, what):
    tau = exchanged(sound.tau, *pair) if 'torque' in what else sound.tau
    mixed = replace(sound, q=exchanged(sound.q, *pair), tau=tau)
    first, second = (robot.joints[joint] for joint in pair)
    expected = f'the {what} of {first} and of {second} seem to be exchanged'
    assert expected in mistake_in(robot, mixed)


@pytest.mark.parametrize('milliseconds', [100, -100, 200])
def test_torque_that_comes_late_or_early(robot, sound, milliseconds):
    said = mistake_in(robot, late(sound, round(1e-3 * milliseconds * RATE)))
    side = 'later' if milliseconds > 0 else 'earlier'
    pattern = rf'about (\d+) ms {side} than the position \(± (\d+) ms\)'
    ((found, half),) = re.findall(pattern, said)
    assert int(found) == pytest.approx(abs(milliseconds), abs=int(half))
    assert int(half) < 0.1 * abs(milliseconds)


@pytest.mark.parametrize('factor', [0.08, 0.3, 5.0])
def test_currents_for_torques(robot, sound, factor):
    said = mistake_in(robot, replace(sound, tau=factor * sound.tau))
    assert 'the efforts of all joints seem to be' in said
    stated = float(said.split('seem to be ')[1].split()[0])
    assert stated == pytest.approx(factor, rel=0.2)


def test_currents_are_no_unit_and_have_the_gain_of_each_joint(robot, sound):
    """Of gains near that of kgf m, as those of a UR10e."""
    gains = np.array([13.3, 11.1, 10.6, 9.5, 12.0, 11.0])
    said = mistake_in(robot, replace(sound, tau=sound.tau / gains))
    assert 'kgf' not in said and 'currents' in said
    stated, hidden = re.search(r'--current-gain (\S+), .*; that of (.+) is not', said).groups()
    known = {k: float(one) for k, one in enumerate(stated.split(',')) if one != '?'}
    np.testing.assert_allclose(list(known.values()), gains[list(known)], rtol=0.1)
    assert set(hidden.split(', ')) == set(robot.joints[4:])


@pytest.mark.parametrize(
    ('factor', 'unit'),
    [(1e3, 'N mm'), (1e2, 'N cm'), (1e-3, 'kN m'), (57.3, 'N m times 57.3')],
)
@pytest.mark.parametrize('rubs', [1.0, 20.0])
def test_a_unit_of_all_torques_is_no_gravity_and_no_current(robot, factor, unit, rubs):
    """Where friction is most of a torque, gravity a thousand times as large explains the rest."""
    recording = recording_of(robot, 1, friction=rubs)
    wrong = replace(recording, tau=factor * recording.tau)
    used = conditioning([wrong], SignalSettings())
    found = find_mistake(robot, wrong, used)
    assert [one.kind for one in found.hypotheses] == ['scale']
    assert f'the efforts of all joints seem to be in {unit}' in found.sentence(robot)
    assert not found.hypotheses[0].disputable


@pytest.mark.parametrize(('factor', 'unit'), [(0.102, 'kgf m'), (9.9, 'kgf cm'), (8.9, 'lbf in')])
def test_a_unit_of_force_times_length_is_a_unit(factor, unit):
    assert unit_of(factor).split(' or ')[0] == unit
    assert unit_of(1.15 * factor) and unit_of(factor, [factor, 1.15 * factor])
    assert unit not in unit_of(factor, [factor, 1.3 * factor])


@pytest.mark.parametrize('factor', [1.62 / 9.81, 0.5, 0.7, 1.1, 1.5, 5.0, 20.0])
def test_a_gain_is_no_unit(factor):
    assert unit_of(factor) == unit_of(-1000.0) == ''


def test_names_of_two_light_joints_exchanged_beside_a_heavy_slide():
    """Hundreds of newtons hide nothing of a joint that takes a tenth of a newton metre."""
    robot = robot_from_urdf(GANTRY)
    arm = ArmModel(robot)
    for name, values in {
        'viscous_friction': (40.0, 2.0, 1.2, 0.15, 0.08),
        'coulomb_friction': (15.0, 1.5, 0.9, 0.2, 0.1),
    }.items():
        arm = arm.with_effect(make_effect(name, robot), np.array(values))
    motion = multisine(robot.joints, 40.0, RATE, seed=3, base_hz=0.1)
    reach = np.array([0.15, 1.0, 1.0, 1.5, 1.2])
    q, dq, ddq = (x * reach for x in (motion.q, motion.dq, motion.ddq))
    sound = recorded(arm, replace(motion, q=q, dq=dq, ddq=ddq))
    assert mistake_in(robot, sound) == ''
    mixed = replace(sound, q=exchanged(sound.q, 3, 4), tau=exchanged(sound.tau, 3, 4))
    said = mistake_in(robot, mixed)
    assert 'the position and torque of turn and of roll seem to be exchanged' in said


def test_degrees(robot, sound):
    assert 'in degrees' in mistake_in(robot, replace(sound, q=np.rad2deg(sound.q)))


def test_positions_within_a_turn_are_not_in_degrees(robot, sound):
    rest = np.zeros_like(sound.q)
    motion = Motion(sound.joints, sound.t, sound.q, rest, rest, sound.tau)
    turned = replace(motion, q=with_column(sound.q, 2, np.rad2deg))
    for motions, expected in (([motion], []), ([motion, turned], [(None,), (2,)])):
        found = [one.where for one in hypotheses(robot, motions) if one.kind == 'degrees']
        assert found == expected


def test_gravity_of_the_earth_on_a_recording_from_the_moon(robot):
    said = mistake_in(robot, recording_of(robot, 1, (0.0, 0.0, -1.62)))
    assert '--gravity moon' in said


@pytest.mark.parametrize(
    'vector', [(9.81, 0.0, 0.0), (-9.81, 0.0, 0.0), (0.0, 9.81, 0.0), (0.0, 0.0, 9.81)]
)
def test_gravity_along_another_axis(robot, vector):
    """Where the first axis is level, its zero being off by a quarter turn looks the same."""
    said = mistake_in(robot, recording_of(robot, 1, vector))
    assert '--gravity ' + ','.join(f'{part:g}' for part in vector) in said
    direction = ', '.join(f'{part / 9.81:g}' for part in vector)
    assert f'along ({direction}) of the base' in said


def test_a_slide_pushes_in_newtons():
    said = in_unit(robot_from_urdf(GANTRY), 0, 'N mm').text
    assert said == 'the torque of lift seems to be in mN instead of N: convert it'


def test_a_description_without_masses_does_not_hide_an_opposite_sign(robot, sound):
    """The body is fitted where every link is said to weigh a kilogram in its joint."""
    link = np.array([1.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 1e-3, 0.0, 0.0, 1e-3])
    nominal = robot.with_inertias(np.tile(link, robot.n_joints))
    turned = replace(sound, q=with_column(sound.q, 1, np.negative))
    assert 'wrong masses in the description' in mistake_in(nominal, sound)
    said = mistake_in(nominal, turned)
    assert 'the position of shoulder_roll seems to have the opposite sign' in said
    assert 'the fitted arm' in said


def test_every_hypothesis_has_a_sentence_with_its_joints(robot, sound):
    turned = Motion(sound.joints, sound.t, *np.tile(np.rad2deg(sound.q), (4, 1, 1)))
    found = [delayed(0.02, 0.004), *hypotheses(robot, [turned])]
    for one in found:
        named = [robot.joints[place] for place in one.where if isinstance(place, int)]
        assert 'seem' in one.text and all(name in one.text for name in named)


@pytest.mark.parametrize(
    ('found', 'told', 'option'),
    [
        ((0.1, -0.2, -1.7), (0.0, 0.0, -9.81), 'moon'),
        ((10.7, -0.9, -0.2), (0.0, 0.0, -9.81), '9.81,0,0'),
        ((0.0, 0.0, 9.7), (0.0, 0.0, -9.81), '0,0,9.81'),
        ((0.0, 0.0, -3.7), (0.0, 0.0, -9.81), '0,0,-3.7'),
    ],
)
def test_a_gravity_that_was_found_is_written_as_a_person_would(found, told, option):
    assert known_gravity(np.array(found), np.array(told))[1] == option


class TestRealRecordings:
    """Real machines have friction, noise and loads that no description has."""

    pytestmark = pytest.mark.real_data

    @pytest.fixture
    def machine(self, request, real_data, tmp_path):
        maker = getattr(real_recordings, request.param)
        found = maker(real_data) if request.param == 'ur10' else maker(real_data, tmp_path)
        robot = load_robot(str(found.robot))
        return robot, [read_recording(bag, joints=robot.joints) for bag in found.bags]

    @pytest.mark.parametrize('machine', ['emps', 'tx40', 'ur10'], indirect=True)
    def test_none_has_a_mistake(self, machine):
        robot, recordings = machine
        assert [mistake_in(robot, recording) for recording in recordings] == [''] * len(recordings)

    @pytest.mark.long
    @pytest.mark.parametrize('machine', ['tx40', 'ur10'], indirect=True)
    def test_mistakes_made_of_them_are_found(self, machine):
        robot, (sound,) = machine
        second, third = robot.joints[1:3]
        tenth = round(0.1 / sound.period)
        for changed, expected in (
            (replace(sound, q=with_column(sound.q, 1, np.negative)), f'position of {second} '),
            (
                replace(sound, q=with_column(sound.q, 2, lambda q: q + np.pi / 2)),
                f'zero of {third} seems to be off by about 90 ',
            ),
            (
                replace(sound, q=exchanged(sound.q, 1, 2), tau=exchanged(sound.tau, 1, 2)),
                f'position and torque of {second} and of {third} ',
            ),
            (replace(sound, tau=0.1 * sound.tau), 'efforts of all joints'),
            (late(sound, tenth), ' ms later than the position'),
        ):
            assert expected in mistake_in(robot, changed)
        assert '--gravity earth' in mistake_in(robot.with_gravity((9.81, 0.0, 0.0)), sound)


def test_five_seconds_have_no_mistake(robot, sound):
    """Of a few seconds a fit leaves anything, and degrees in place of rad leave less."""
    assert mistake_in(robot, sound.select(slice(0, 500))) == ''
