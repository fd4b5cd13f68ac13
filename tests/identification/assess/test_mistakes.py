# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Mistakes and delays of recordings are found and named; sound recordings are left in peace."""

from dataclasses import replace
from functools import partial
import re

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.effects.slipping import Hysteresis
from armid_ros.identification.assess import mistakes
from armid_ros.identification.assess.hypotheses import in_unit, other_gravity
from armid_ros.identification.assess.mistakes import find_mistake, torque_delay
from armid_ros.identification.assess.prediction_error import PredictionError
from armid_ros.identification.rows.checks import unit_of
from armid_ros.identification.rows.signals import conditioning, SignalSettings
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


def changed(recording, joint, q=1.0, tau=1.0, degrees=0.0):
    """Scale position and torque of a joint, and shift its zero."""
    one = np.arange(recording.n_joints) == joint
    shifted = recording.q * np.where(one, q, 1.0) + np.deg2rad(degrees) * one
    return replace(recording, q=shifted, tau=recording.tau * np.where(one, tau, 1.0))


def exchanged(recording, first, second, torque):
    """Exchange the positions of two joints, and their torques."""
    order = np.arange(recording.n_joints)
    order[[first, second]] = second, first
    tau = recording.tau[:, order] if torque else recording.tau
    return replace(recording, q=recording.q[:, order], tau=tau)


@pytest.mark.parametrize(
    ('wrong', 'kind', 'fact'),
    [
        (partial(changed, joint=0, q=-1.0), ('sign', 0, 'position'), ''),
        (partial(changed, joint=3, q=-1.0, tau=-1.0), ('sign', 3, 'position and torque'), ''),
        (partial(changed, joint=0, tau=1e3), ('unit', 0, 'N mm'), ''),
        (partial(changed, joint=2, tau=1e2), ('unit', 2, 'N cm'), ''),
        (partial(changed, joint=3, tau=1e-3), ('unit', 3, 'kN m'), ''),
        (partial(changed, joint=1, q=np.rad2deg(1.0)), ('degrees', 1), ''),
        (partial(changed, joint=1, degrees=-90.0), ('zero', 1), '-90 degrees'),
        (partial(changed, joint=3, degrees=180.0), ('zero', 3), '180 degrees'),
        (partial(exchanged, first=0, second=1, torque=True), ('exchange', 0, 1), ''),
        (partial(exchanged, first=0, second=3, torque=False), ('exchange', 0, 3), ''),
    ],
)
def test_a_mistake_is_found_with_its_joints(robot, sound, wrong, kind, fact):
    found = find(robot, wrong(sound))
    kinds = [(one.kind, *one.where) for one in found.hypotheses]
    assert kind in [one[: len(kind)] for one in kinds]
    assert fact in found.sentence(robot)


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
        ((4.267, 0.0, -7.392), '4.904,0,-8.496'),  # of 0.87 times the size, as masses may be
    ],
)
def test_gravity_is_a_body_of_the_solar_system_or_is_turned(robot, vector, option):
    """Weight half as much again is of masses."""
    found = other_gravity(robot, np.array(vector))
    assert (found is None) == (option is None)
    assert found is None or f'--gravity {option}' in found.text


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


@pytest.mark.parametrize(
    ('factor', 'unit'),
    [
        (0.102, 'kgf m'),
        (9.9, 'kgf cm'),
        (8.9, 'lbf in'),
        *((gain, '') for gain in (1.62 / 9.81, 0.5, 0.7, 1.1, 1.5, 5.0, 20.0, -1000.0)),
    ],
)
def test_a_unit_is_a_factor_that_no_gain_has(factor, unit):
    assert unit_of(factor).split(' or ')[0] == unit
    assert bool(unit_of(factor, [factor, 1.15 * factor])) == bool(unit)
    assert not unit or unit not in unit_of(factor, [factor, 1.3 * factor])


def test_a_slide_pushes_in_newtons():
    slide = robot_from_urdf(real_recordings.EMPS_URDF)
    assert 'mN instead of N:' in in_unit(slide, 0, 'N mm').text


@pytest.mark.parametrize('vector', [(9.81, 0.0, 0.0), (0.0, 9.81, 0.0), (0.0, 0.0, 9.81)])
def test_gravity_along_another_axis(robot, vector):
    """Where the first axis is level, its zero being off by a quarter turn looks the same."""
    said = sentence(robot, recording_of(robot, 1, vector))
    assert '--gravity ' + ','.join(f'{part:g}' for part in vector) in said


def test_a_description_without_masses_does_not_hide_an_opposite_sign(robot, sound):
    """The body is fitted where every link is said to weigh a kilogram in its joint."""
    link = np.array([1.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 1e-3, 0.0, 0.0, 1e-3])
    nominal = robot.with_inertias(np.tile(link, robot.n_joints))
    turned = changed(sound, 1, q=-1.0)
    assert kinds(nominal, sound) == [('scale',)]
    assert ('sign', 1, 'position') in kinds(nominal, turned)
    assert find(nominal, turned).fitted


def giving_way(robot, length, seed, share=1.0):
    """Record an arm near its description whose friction gives way over a length [rad]."""
    rng = np.random.default_rng(seed)
    n = robot.n_joints
    links = robot.rigid_parameters.reshape(-1, 10) * rng.uniform(0.9, 1.1, (n, 1))
    arm = ArmModel(robot.with_inertias(links.ravel()))
    motion = multisine(robot.joints, 30.0, RATE, seed=seed, base_hz=0.12)
    exact = recorded(arm, motion, seed, position_noise=1e-5)
    size = np.sqrt(np.mean(exact.tau**2, axis=0))
    bent = Hysteresis(np.eye(n), np.ones(n), length * rng.uniform(0.6, 1.6, n))
    friction = share * size * (bent.along(motion.q, motion.dq) + 0.3 * motion.dq)
    noise = 0.01 * size * rng.normal(size=exact.tau.shape)
    return replace(exact, tau=exact.tau + friction + noise)


def delayed(recording, seconds):
    """Return a recording whose torques are read late."""
    tau = [np.interp(recording.t - seconds, recording.t, column) for column in recording.tau.T]
    return replace(recording, tau=np.column_stack(tau))


def told(robot, recording):
    """Return the delay that is told of a recording; none where it is told from no zero."""
    return torque_delay(robot, recording, conditioning([recording], SignalSettings()))


@pytest.mark.parametrize(('length', 'share'), [(1e-4, 2.0), (1e-3, 0.5), (3e-3, 2.0), (1e-2, 0.5)])
def test_friction_that_gives_way_is_no_delay(robot, length, share):
    """Friction of half and of twice the torque of the body, over a tenth to ten milliradians."""
    recording = giving_way(robot, length, 3, share)
    found = find_mistake(robot, recording, conditioning([recording], SignalSettings()))
    assert found is None
    late = told(robot, recording)
    assert late is None or abs(late.seconds) - late.half_width < 2e-3


@pytest.mark.parametrize(
    ('length', 'seconds'), [(1e-4, -0.05), (2e-3, 0.1), (1e-2, 0.02), (1e-2, 0.05)]
)
def test_a_delay_is_told_beside_friction_that_gives_way(robot, length, seconds):
    recording = delayed(giving_way(robot, length, 4), seconds)
    late = told(robot, recording)
    assert late is not None
    assert late.seconds == pytest.approx(seconds, abs=late.half_width + 1e-3)
    assert late.half_width < 0.01
    weightless = robot.with_inertias(0.0 * robot.rigid_parameters)
    assert told(weightless, recording) is None


def test_an_interval_holds_the_delay_of_most_recordings(robot):
    """Nineteen of twenty are expected to; of twenty, fewer than sixteen are one chance in 400."""
    held = 0
    for seed in range(20):
        late = told(robot, delayed(giving_way(robot, 2e-3, 100 + seed), 0.03))
        held += late is not None and abs(late.seconds - 0.03) <= late.half_width
    assert held >= 16
