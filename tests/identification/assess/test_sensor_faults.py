# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sensors and joints that contradict the arm: dead, in another unit, or not driven."""

from dataclasses import replace
import re

from armid_ros import inspect
from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import grade, identify
from armid_ros.identification.assess.data_faults import unit_faults
from armid_ros.identification.assess.sensor_faults import (
    encoder_faults,
    held_elsewhere,
    units_beyond_drives,
    velocity_faults,
)
from armid_ros.identification.rows.signals import conditioning, segments, SignalSettings
from armid_ros.model import inverse_dynamics
from armid_ros.recording import Recording
from armid_ros.recording.recording import PositionRange
from armid_ros.robots import described_at, held_joints, load_robot, robot_from_urdf
import numpy as np
import pytest
from scipy import signal

from ..conftest import multisine, recorded

RATE = 100.0
JOINTS = (0, 3, 5)


def record(arm, seed, held=None, source='run', noise=0.01):
    """Record a motion with velocities; one joint may be locked."""
    motion = multisine(arm.robot.joints, 20.0, RATE, seed=seed, base_hz=0.12)
    q, dq, ddq = (getattr(motion, name).copy() for name in ('q', 'dq', 'ddq'))
    if held is not None:
        q[:, held], dq[:, held], ddq[:, held] = 0.3, 0.0, 0.0
    motion = replace(motion, q=q, dq=dq, ddq=ddq)
    rng = np.random.default_rng(seed)
    tau = arm.torque(motion)
    tau = tau + noise * np.std(tau, axis=0) * rng.normal(size=tau.shape)
    reads = 1e-5 * rng.normal(size=q.shape) * (np.arange(6) != held)
    return Recording(joints=motion.joints, t=motion.t, q=q + reads, dq=dq, tau=tau, source=source)


def stuck(recording, joint, since=0):
    """Return a recording in which the position of a joint does not change any more."""
    q = recording.q.copy()
    q[since:, joint] = q[since, joint]
    return replace(recording, q=q)


def said(robot, recording):
    return [fault.text for fault in encoder_faults(recording, robot.position_units)]


@pytest.mark.parametrize('joint', JOINTS)
@pytest.mark.parametrize('since', [0, 1000])
def test_a_velocity_that_goes_on_shows_a_dead_encoder(arm, joint, since):
    (text,) = said(arm.robot, stuck(record(arm, 1), joint, since))
    assert f'position of {arm.robot.joints[joint]}' in text
    assert ('10.000 s' if since else 'throughout') in text


@pytest.mark.parametrize('joint', JOINTS)
def test_a_velocity_that_stays_while_its_position_moves_is_dead(arm, joint):
    recording = record(arm, 1)
    (text,) = said(arm.robot, replace(recording, dq=recording.dq * (np.arange(6) != joint)))
    assert f'velocity of {arm.robot.joints[joint]}' in text


@pytest.mark.parametrize(
    ('stated', 'dead'), [(1.0, False), (0.98, False), (0.0, True), (-1.0, True)]
)
def test_a_constant_speed_is_dead_where_it_is_not_the_way_gone(arm, stated, dead):
    """A turntable goes round; its velocity does not change by one count."""
    run, speed = record(arm, 1), 0.7
    q, dq = run.q.copy(), run.dq.copy()
    q[:, 0] = q[0, 0] + speed * run.t
    dq[:, 0] = stated * speed
    turning = replace(run, q=q, dq=dq)
    found = [text for text in said(arm.robot, turning) if 'velocity' in text]
    assert bool(found) == dead
    remarks = inspect(turning).remarks
    assert sum('velocit' in text for text in remarks) == dead


def waiting(moves, waits):
    """Return a recording in which a joint waits for the others from 10 s on."""
    parts = {
        name: np.concatenate([getattr(moves, name)[:1000], getattr(waits, name)[1000:]])
        for name in ('q', 'dq', 'tau')
    }
    return replace(moves, **parts)


@pytest.mark.parametrize(
    'change',
    [
        waiting,
        lambda moves, waits: replace(moves, dq=0.0 * moves.dq),
        lambda moves, waits: replace(moves, dq=None),
        lambda moves, waits: replace(moves, q=5e-3 * np.round(moves.q / 5e-3)),
    ],
    ids=['waits', 'velocities of zero', 'no velocities', 'coarse'],
)
def test_what_is_no_dead_encoder(arm, change):
    assert said(arm.robot, change(record(arm, 1), record(arm, 1, held=3))) == []


@pytest.mark.parametrize(('joint', 'seed'), [(0, 1), (3, 2), (5, 3)])
def test_a_joint_that_is_held_is_not_dead(arm, joint, seed):
    """Weight and the other joints make its torque, with masses that are described wrongly."""
    links = arm.robot.rigid_parameters.reshape(-1, 10)
    scale = np.random.default_rng(seed).uniform(0.8, 1.2, (6, 1))
    other = ArmModel(arm.robot.with_inertias((links * scale).ravel()), arm.effects, arm.values)
    recording = record(other, seed, held=joint)
    assert said(arm.robot, recording) == []
    noise = np.random.default_rng(0).normal(size=len(recording)) * 5e-3
    dq = recording.dq.copy()
    dq[:, joint] = 1e-3 + noise
    assert said(arm.robot, replace(recording, dq=dq)) == []


@pytest.fixture(scope='module')
def blind(arm):
    return stuck(record(arm, 1), 5)


@pytest.fixture(scope='module')
def locked(arm):
    return record(arm, 1, held=5)


def test_identification_grades_the_one_as_unusable_and_not_the_other(structure, blind, locked):
    for recording, word in ((blind, 'unusable'), (locked, 'poor')):
        result = identify(structure, [recording], rng=np.random.default_rng(0))
        found = grade(result, structure, [recording], {})
        assert found.word == word
        assert ('frozen' in ' '.join(found.reasons)) == (word == 'unusable')


def test_inspection_says_so_with_and_without_a_robot(arm, blind, locked):
    for known in ((arm,), ()):
        found = inspect(*known, blind).core
        assert found.remarks[0].weight == 'bad'
        assert 'frozen' in found.remarks[0].text
        sound = inspect(*known, locked).core
        assert not any(remark.weight == 'bad' for remark in sound.remarks)


WRIST = 5
LIMIT = 10.0


@pytest.fixture(scope='module')
def light_arm():
    robot = load_robot('humanoid_arm')
    robot = replace(robot, torque_limit=np.where(np.arange(6) == WRIST, LIMIT, 1e3))
    body = robot.rigid_parameters.reshape(-1, 10).copy()
    body[WRIST] = 0.0
    light = ArmModel(robot.with_inertias(body.ravel()))
    return light.with_effect(make_effect('coulomb_friction', robot), np.full(6, 0.6))


@pytest.fixture(scope='module')
def light_run(light_arm):
    return recorded(
        light_arm, multisine(light_arm.robot.joints, 10.0, 100.0, seed=3), torque_noise=0.01
    )


def times(recording, factor, joints=(WRIST,)):
    tau = recording.tau.copy()
    tau[:, list(joints)] *= factor
    return replace(recording, tau=tau)


def filtered(recording):
    return list(segments(recording, conditioning([recording], SignalSettings())))


def beyond_drives(robot, recording):
    return list(units_beyond_drives(robot, [recording], filtered(recording)))


def test_half_of_the_readings_at_sixty_times_a_limit_are_in_another_unit(light_arm, light_run):
    (said,) = beyond_drives(light_arm.robot, times(light_run, 1e3))
    assert light_arm.robot.joints[WRIST] in said and 'another unit' in said


def test_torques_in_newton_metres_and_a_few_wrong_samples_are_no_unit(light_arm, light_run):
    assert beyond_drives(light_arm.robot, light_run) == []
    spoilt = light_run.tau.copy()
    spoilt[::50, WRIST] = 1e4
    assert beyond_drives(light_arm.robot, replace(light_run, tau=spoilt)) == []


def test_currents_are_in_no_one_unit(light_arm, light_run):
    gains = np.array([0.083, 0.025, 0.09, 0.125, 0.3, 0.5])
    currents = replace(light_run, tau=light_run.tau / gains)
    (said,) = unit_faults(light_arm, filtered(currents), filtered(light_run))
    assert 'currents?' in said
    assert said.endswith('--current-gain 0.083,0.025,0.09,0.125,0.3,0.5')
    assert unit_faults(light_arm, filtered(light_run), filtered(light_run)) == []
    (said,) = unit_faults(
        light_arm, filtered(replace(light_run, tau=1e3 * light_run.tau)), filtered(light_run)
    )
    assert 'N mm' in said


@pytest.mark.parametrize(('factor', 'unit'), [(1e3, 'N mm'), (1e2, 'N cm'), (1e-3, 'kN m')])
def test_a_model_with_the_friction_tells_the_unit(light_arm, light_run, factor, unit):
    (said,) = unit_faults(light_arm, filtered(times(light_run, factor)))
    assert light_arm.robot.joints[WRIST] in said and f'in {unit} ' in said


@pytest.mark.parametrize('factor', [1.0, 3.0, 20.0])
def test_other_factors_and_all_joints_alike_are_no_unit_of_a_joint(light_arm, light_run, factor):
    assert unit_faults(light_arm, filtered(times(light_run, factor))) == []
    assert unit_faults(light_arm, filtered(times(light_run, 1e3 * factor, range(6)))) == []


def test_a_factor_that_was_there_before_is_that_of_the_model(light_arm, light_run):
    wrong = filtered(times(light_run, 1e3))
    assert unit_faults(light_arm, wrong, wrong) == []
    assert len(unit_faults(light_arm, wrong, filtered(light_run))) == 1


def test_the_grade_of_a_fit_of_such_a_torque_is_poor(light_arm, light_run):
    wrong = times(light_run, 1e3)
    fitted = identify(light_arm, [wrong], rng=np.random.default_rng(0))
    found = grade(fitted, light_arm, [wrong], {})
    assert found.word == 'poor'
    assert light_arm.robot.joints[WRIST] in found.reasons[0]


GRIPPER = """<robot name="with_a_gripper">
  <link name="base"/>
  <link name="arm"><inertial><origin xyz="0.3 0 0"/><mass value="4"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="left"><inertial><origin xyz="0 0 0.02"/><mass value="0.03"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
  <link name="right"><inertial><origin xyz="0 0 0.02"/><mass value="0.03"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="3" effort="90"/></joint>
  <joint name="jaw" type="prismatic"><parent link="arm"/><child link="left"/>
    <origin xyz="0.6 0 0"/><axis xyz="0 1 0"/>
    <limit lower="0.01" upper="0.05" velocity="1" effort="9"/></joint>
  <joint name="other_jaw" type="prismatic"><parent link="arm"/><child link="right"/>
    <origin xyz="0.6 0 0"/><axis xyz="0 -1 0"/><mimic joint="jaw" multiplier="2" offset="0.01"/>
    <limit lower="0" upper="0.2" velocity="1" effort="9"/></joint>
</robot>"""


@pytest.fixture(scope='module')
def whole():
    return load_robot('humanoid_arm')


def without(whole, joint):
    driven = tuple(name for name in whole.joints if name != joint)
    return load_robot('humanoid_arm', joints=driven)


def driven_run(whole, joint, positions, seed=1, source='run'):
    """Record all but one joint of an arm, which is at given positions, shape (N,) or ()."""
    motion = multisine(whole.joints, 20.0, RATE, seed=seed, base_hz=0.12)
    own = whole.index(joint)
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    q[:, own], dq[:, own], ddq[:, own] = positions(motion, own)
    arm = ArmModel(whole)
    tau = arm.torque(replace(motion, q=q, dq=dq, ddq=ddq))
    tau += 0.01 * np.random.default_rng(seed).normal(size=tau.shape)
    rest = [k for k in range(whole.n_joints) if k != own]
    return Recording(
        joints=tuple(whole.joints[k] for k in rest),
        t=motion.t,
        q=q[:, rest],
        tau=tau[:, rest],
        source=source,
        others=(PositionRange(joint, float(q[:, own].min()), float(q[:, own].max())),),
    )


def moving(motion, own):
    return motion.q[:, own], motion.dq[:, own], motion.ddq[:, own]


def standing(position):
    return lambda motion, own: (position, 0.0, 0.0)


def felt(robot):
    motion = multisine(robot.joints, 5.0, RATE, seed=2)
    return motion.with_torque(inverse_dynamics(robot, motion))


def graded(robot, recordings):
    structure = ArmModel(robot)
    result = identify(structure, recordings, rng=np.random.default_rng(0))
    return grade(result, structure, recordings, {})


@pytest.mark.parametrize('position', [0.0, 1.1])
def test_the_described_arm_with_a_joint_held_is_the_whole_arm_with_it_there(whole, position):
    joint = whole.joints[3]
    motion = multisine(whole.joints, 2.0, RATE, seed=3)
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    q[:, 3], dq[:, 3], ddq[:, 3] = position, 0.0, 0.0
    rest = [0, 1, 2, 4, 5]
    expected = inverse_dynamics(whole, replace(motion, q=q, dq=dq, ddq=ddq))
    held = described_at(without(whole, joint).with_gravity([0.3, 0.1, -9.0]), {joint: position})
    np.testing.assert_allclose(held.gravity, [0.3, 0.1, -9.0])
    held = held.with_gravity(whole.gravity)
    subset = type(motion)(held.joints, motion.t, q[:, rest], dq[:, rest], ddq[:, rest])
    np.testing.assert_allclose(inverse_dynamics(held, subset), expected[:, rest], atol=1e-9)


def test_a_joint_that_mimics_one_that_is_held_follows_it():
    robot = robot_from_urdf(GRIPPER)
    assert [joint.position for joint in held_joints(robot)] == pytest.approx([0.01, 0.03])
    named = described_at(robot, {'jaw': 0.04, 'other_jaw': 0.09}).rigid_parameters
    np.testing.assert_allclose(described_at(robot, {'jaw': 0.04}).rigid_parameters, named)
    np.testing.assert_allclose(described_at(robot, {}).rigid_parameters, robot.rigid_parameters)


@pytest.mark.parametrize('index', [1, 4])
def test_a_joint_that_moves_without_being_driven_is_never_passed_over(whole, index):
    joint = whole.joints[index]
    found = graded(without(whole, joint), [driven_run(whole, joint, moving)])
    (reason,) = (text for text in found.reasons if joint in text and 'not driven' in text)
    assert '--joints' in reason
    assert found.word != 'good'


@pytest.mark.parametrize(
    ('joint', 'place', 'matters'), [(1, 0.9, True), (1, 0.0, False), (5, 0.9, False)]
)
def test_a_joint_that_carries_others_and_stands_elsewhere_is_named(whole, joint, place, matters):
    """A last joint is a part of the body, wherever it stands."""
    joint = whole.joints[joint]
    robot = without(whole, joint)
    found = list(held_elsewhere(robot, [driven_run(whole, joint, standing(place))], [felt(robot)]))
    assert len(found) == matters
    assert all(joint in one.text and '0.9 rad' in one.text for one in found)


def test_a_joint_that_stands_elsewhere_in_each_recording_has_moved(whole):
    joint = whole.joints[4]
    robot = without(whole, joint)
    recordings = [
        driven_run(whole, joint, standing(place), seed, f'run_{seed}')
        for seed, place in ((1, -1.2), (2, 1.2))
    ]
    (found,) = held_elsewhere(robot, recordings, [felt(robot)])
    assert joint in found.text and '-1.2' in found.text


@pytest.fixture(scope='module')
def timed(arm):
    motion = multisine(arm.robot.joints, 20.0, RATE, seed=1, base_hz=0.12)
    made = recorded(arm, motion, torque_noise=0.01, position_noise=1e-4, source='run')
    noise = 0.05 * np.random.default_rng(2).normal(size=motion.dq.shape)
    return replace(made, dq=motion.dq + noise)


def time_faults(recording):
    return [fault.text for fault in velocity_faults(recording) if fault.word != 'good']


@pytest.mark.parametrize('factor', [0.5, 0.9, 1.1, 3.0])
def test_a_wrong_time_is_said(timed, factor):
    (said,) = time_faults(replace(timed, t=factor * timed.t))
    number = re.search(r'(\S+) times', said).group(1)
    assert float(number) == pytest.approx(factor, rel=0.01)


def jittering(timed):
    by = np.random.default_rng(3).uniform(-0.02, 0.02, len(timed))
    return replace(timed, t=np.sort(timed.t + by))


@pytest.mark.parametrize(
    'change',
    [
        lambda timed: replace(timed, dq=signal.lfilter([0.06], [1.0, -0.94], timed.dq, axis=0)),
        jittering,
        lambda timed: timed.select(np.r_[0:700, 1100:2000]),
        lambda timed: replace(timed, dq=timed.dq * np.array([1.0, 1.0, 1.2, 1.0, 1.0, 1.0])),
        lambda timed: replace(timed, dq=np.rad2deg(timed.dq)),
        lambda timed: timed.select(slice(None, None, 8)),
        lambda timed: replace(timed, dq=1.03 * timed.dq),
        lambda timed: replace(timed, dq=None),
    ],
    ids=['late', 'jitter', 'gap', 'one joint', 'degrees', 'coarse', 'slightly off', 'without'],
)
def test_what_noise_filters_and_units_make_is_no_wrong_time(timed, change):
    assert time_faults(change(timed)) == []
