# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mistakes of recordings are found and named; recordings without any are left in peace."""

from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.assess import mistakes
from armid_ros.identification.assess.hypotheses import in_unit, other_gravity
from armid_ros.identification.assess.mistakes import find_mistake
from armid_ros.identification.assess.prediction_error import PredictionError
from armid_ros.identification.rows.checks import unit_of
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot, robot_from_urdf
import numpy as np
import pytest

from benchmarks import real_recordings

from ..conftest import FRICTION, multisine, recorded

RATE = 100.0


def recording_of(robot, seed, gravity=None, friction=1.0, motion=None):
    """Record an arm whose links are up to a fifth lighter or heavier than described."""
    rng = np.random.default_rng(seed)
    body = robot if gravity is None else robot.with_gravity(gravity)
    links = body.rigid_parameters.reshape(-1, 10) * rng.uniform(0.8, 1.2, (robot.n_joints, 1))
    arm = ArmModel(body.with_inertias(links.ravel()))
    for name, value in FRICTION.items():
        arm = arm.with_effect(make_effect(name, robot), friction * np.full(robot.n_joints, value))
    if motion is None:
        motion = multisine(robot.joints, 20.0, RATE, seed=100 + seed, base_hz=0.12)
    exact = recorded(arm, motion)
    noise = 0.02 * np.sqrt(np.mean(exact.tau**2, axis=0)) * rng.normal(size=exact.tau.shape)
    return replace(exact, tau=exact.tau + noise)


def find(robot, recording):
    """Return the mistake of a recording; None without any."""
    return find_mistake(robot, recording, conditioning([recording], SignalSettings()))


def kinds(robot, recording):
    """Return what may be wrong, each with its joints."""
    found = find(robot, recording)
    return [] if found is None else [(one.kind, *one.where) for one in found.hypotheses]


def sentence(robot, recording):
    """Return the text of the mistake of a recording."""
    return find(robot, recording).sentence(robot)


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
def sound(robot):
    return recording_of(robot, 1)


@pytest.mark.parametrize('name', ['humanoid_arm', 'ur10', 'panda'])
@pytest.mark.parametrize('seed', range(2))
def test_recordings_of_arms_drawn_at_random_have_none(name, seed):
    paths = {
        'ur10': 'ur_description/urdf/ur10_robot.urdf',
        'panda': 'panda_description/urdf/panda.urdf',
    }
    source = str(real_recordings.example_robot(paths[name])) if name in paths else name
    robot = load_robot(source)
    assert find(robot, recording_of(robot, seed)) is None


def test_links_that_absorb_a_missing_effect_are_no_mistake(robot, sound, monkeypatch):
    """A hypothesis that only brings the fitted links back to their prior is not accepted."""
    ones = np.ones(robot.n_joints)

    def error(_robot, _motions, one, *, near):
        off = 110.0 if one.kind == 'nothing' else 20.0
        return PredictionError(0.4 * ones, ones, off if near else 0.0)

    monkeypatch.setattr(mistakes, '_error', error)
    assert find(robot, sound) is None


def test_a_few_seconds_have_no_mistake(robot, sound):
    """Of them a fit leaves anything, and degrees in place of rad leave less."""
    assert find(robot, sound.select(slice(0, 500))) is None


@pytest.mark.parametrize(
    ('joint', 'q', 'tau', 'kind', 'what'),
    [
        (0, -1.0, 1.0, 'sign', ['position']),
        (3, -1.0, -1.0, 'sign', ['position and torque']),
        (0, 1.0, 1e3, 'unit', ['N mm']),
        (2, 1.0, 1e2, 'unit', ['N cm']),
        (3, 1.0, 1e-3, 'unit', ['kN m']),
        (1, np.rad2deg(1.0), 1.0, 'degrees', []),
    ],
)
def test_sign_and_unit_of_one_joint(robot, sound, joint, q, tau, kind, what):
    wrong = replace(
        sound,
        q=with_column(sound.q, joint, lambda values: q * values),
        tau=with_column(sound.tau, joint, lambda values: tau * values),
    )
    assert (kind, joint, *what) in kinds(robot, wrong)


@pytest.mark.parametrize(('joint', 'degrees'), [(0, 90.0), (1, -90.0), (3, 180.0)])
def test_a_zero_that_is_off(robot, sound, joint, degrees):
    off = replace(sound, q=with_column(sound.q, joint, lambda q: q + np.deg2rad(degrees)))
    assert ('zero', joint) in kinds(robot, off)
    assert f'{degrees:.0f} degrees' in sentence(robot, off)


@pytest.mark.parametrize(
    ('vector', 'option'),
    [
        ((0.0, 0.0, -14.3), None),
        ((0.0, 0.0, -6.0), None),
        ((0.1, -0.2, -1.7), 'moon'),
        ((0.0, 0.0, -3.7), '0,0,-3.7'),
        ((0.0, 3.4, -9.2), ''),
        ((0.0, 5.0, -13.4), ''),
        ((10.7, -0.9, -0.2), '9.81,0,0'),
        ((0.0, 0.0, 9.7), '0,0,9.81'),
    ],
)
def test_weight_half_as_much_again_is_of_masses_and_not_of_gravity(robot, vector, option):
    found = other_gravity(robot, np.array(vector))
    assert (found is None) == (option is None)
    assert found is None or f'--gravity {option}' in found.text


def test_a_turned_gravity_keeps_the_described_size_unless_no_mass_explains_it(robot):
    found = other_gravity(robot, 0.87 * np.array([4.905, 0.0, -8.496]))
    assert '--gravity 4.905,0,-8.496' in found.text and 'masses' in found.text
    assert 'masses' not in other_gravity(robot, np.array([4.9, -0.04, -8.4])).text


@pytest.mark.parametrize(('pair', 'what'), [((0, 1), 'position and torque'), ((0, 3), 'position')])
def test_exchanged_joints(robot, sound, pair, what):
    tau = exchanged(sound.tau, *pair) if 'torque' in what else sound.tau
    mixed = replace(sound, q=exchanged(sound.q, *pair), tau=tau)
    assert ('exchange', *pair, what) in kinds(robot, mixed)


@pytest.mark.parametrize('milliseconds', [100, -100, 200])
def test_torque_that_comes_late_or_early(robot, sound, milliseconds):
    said = sentence(robot, late(sound, round(1e-3 * milliseconds * RATE)))
    assert ('later' if milliseconds > 0 else 'earlier') in said
    found, half = re.findall(r'(\d+) ms', said)
    assert int(found) == pytest.approx(abs(milliseconds), abs=int(half))
    assert int(half) < 0.1 * abs(milliseconds)


@pytest.mark.parametrize('factor', [0.08, 5.0])
def test_currents_for_torques(robot, sound, factor):
    currents = replace(sound, tau=factor * sound.tau)
    assert ('scale',) in kinds(robot, currents)
    (stated,) = re.findall(r'(\S+) times', sentence(robot, currents))
    assert float(stated) == pytest.approx(factor, rel=0.2)


def test_currents_are_no_unit_and_have_the_gain_of_each_joint(robot, sound):
    """Of gains near that of kgf m, as those of a UR10e."""
    gains = np.array([13.3, 11.1, 10.6, 9.5, 12.0, 11.0])
    said = find(robot, replace(sound, tau=sound.tau / gains)).text
    assert 'kgf' not in said and 'currents' in said
    (stated,) = re.findall(r'--current-gain (\S+),', said)
    known = {k: float(one) for k, one in enumerate(stated.split(',')) if one != '?'}
    np.testing.assert_allclose(list(known.values()), gains[list(known)], rtol=0.1)
    assert all((name in said) == (k not in known) for k, name in enumerate(robot.joints))


@pytest.mark.parametrize(
    ('factor', 'unit', 'rubs'),
    [(1e3, 'N mm', 20.0), (1e-3, 'kN m', 1.0), (57.3, 'times 57.3', 20.0)],
)
def test_a_unit_of_all_torques_is_no_gravity_and_no_current(robot, factor, unit, rubs):
    """Where friction is most of a torque, gravity a thousand times as large explains the rest."""
    recording = recording_of(robot, 1, friction=rubs)
    wrong = replace(recording, tau=factor * recording.tau)
    found = find(robot, wrong)
    assert [one.kind for one in found.hypotheses] == ['units']
    assert unit in found.sentence(robot)


@pytest.mark.parametrize(('factor', 'unit'), [(0.102, 'kgf m'), (9.9, 'kgf cm'), (8.9, 'lbf in')])
def test_a_unit_of_force_times_length_is_a_unit(factor, unit):
    assert unit_of(factor).split(' or ')[0] == unit
    assert unit_of(1.15 * factor) and unit_of(factor, [factor, 1.15 * factor])
    assert unit not in unit_of(factor, [factor, 1.3 * factor])


@pytest.mark.parametrize('factor', [1.62 / 9.81, 0.5, 0.7, 1.1, 1.5, 5.0, 20.0])
def test_a_gain_is_no_unit(factor):
    assert unit_of(factor) == unit_of(-1000.0) == ''


@pytest.mark.parametrize('vector', [(9.81, 0.0, 0.0), (0.0, 9.81, 0.0), (0.0, 0.0, 9.81)])
def test_gravity_along_another_axis(robot, vector):
    """Where the first axis is level, its zero being off by a quarter turn looks the same."""
    said = sentence(robot, recording_of(robot, 1, vector))
    assert '--gravity ' + ','.join(f'{part:g}' for part in vector) in said


def test_a_slide_pushes_in_newtons():
    slide = robot_from_urdf(real_recordings.EMPS_URDF)
    assert 'mN instead of N:' in in_unit(slide, 0, 'N mm').text


def test_a_description_without_masses_does_not_hide_an_opposite_sign(robot, sound):
    """The body is fitted where every link is said to weigh a kilogram in its joint."""
    link = np.array([1.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 1e-3, 0.0, 0.0, 1e-3])
    nominal = robot.with_inertias(np.tile(link, robot.n_joints))
    turned = replace(sound, q=with_column(sound.q, 1, np.negative))
    assert kinds(nominal, sound) == [('scale',)]
    assert ('sign', 1, 'position') in kinds(nominal, turned)
    assert find(nominal, turned).fitted


@pytest.mark.real_data
@pytest.mark.parametrize('machine', ['emps', 'tx40', 'ur10'])
def test_recordings_of_real_machines_have_none(machine, real_data, tmp_path):
    maker = getattr(real_recordings, machine)
    data = maker(real_data) if machine == 'ur10' else maker(real_data, tmp_path)
    robot = load_robot(str(data.robot))
    for bag in data.bags:
        assert find(robot, read_recording(bag, joints=robot.joints)) is None
