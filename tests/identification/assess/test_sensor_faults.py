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


def record(arm, seed, held=None, noise=0.01):
    """Record a motion with velocities; one joint may be locked."""
    motion = multisine(arm.robot.joints, 20.0, RATE, seed=seed, base_hz=0.12)
    if held is not None:
        motion = with_joint_at(motion, held, 0.3)
    recording = recorded(arm, motion, source='run')
    rng = np.random.default_rng(seed)
    tau = recording.tau
    tau = tau + noise * np.std(tau, axis=0) * rng.normal(size=tau.shape)
    reads = 1e-5 * rng.normal(size=tau.shape) * (np.arange(6) != held)
    return replace(recording, q=motion.q + reads, dq=motion.dq, tau=tau)


def with_joint_at(motion, joint, position):
    """Return a motion in which one joint stands still."""
    others = np.arange(motion.n_joints) != joint
    q = np.where(others, motion.q, position)
    return replace(motion, q=q, dq=others * motion.dq, ddq=others * motion.ddq)


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


def test_an_identification_with_a_dead_encoder_is_unusable_and_with_a_locked_joint_poor(
    arm, structure
):
    blind, locked = stuck(record(arm, 1), 5), record(arm, 1, held=5)
    for recording, word in ((blind, 'unusable'), (locked, 'poor')):
        result = identify(structure, [recording], rng=np.random.default_rng(0))
        found = grade(result, structure, [recording], {})
        assert found.word == word
        assert ('frozen' in ' '.join(found.reasons)) == (word == 'unusable')


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


@pytest.mark.parametrize(('factor', 'unit'), [(1e3, 'N mm'), (1e2, 'N cm'), (1e-3, 'kN m')])
def test_a_model_with_friction_and_the_limits_of_drives_tell_the_unit(
    light_arm, light_run, factor, unit
):
    wrong, wrist = times(light_run, factor), light_arm.robot.joints[WRIST]
    (fault,) = unit_faults(light_arm, filtered(wrong))
    assert wrist in fault and f'in {unit} ' in fault
    beyond = list(units_beyond_drives(light_arm.robot, [wrong], filtered(wrong)))
    assert [wrist in one for one in beyond] == [True] * (factor > 1e2)


def test_other_factors_all_joints_alike_and_a_few_samples_are_no_unit(light_arm, light_run):
    for factor in (1.0, 3.0, 20.0):
        assert unit_faults(light_arm, filtered(times(light_run, factor))) == []
        assert unit_faults(light_arm, filtered(times(light_run, 1e3 * factor, range(6)))) == []
    spoilt = light_run.tau.copy()
    spoilt[::50, WRIST] = 1e4
    few = replace(light_run, tau=spoilt)
    assert list(units_beyond_drives(light_arm.robot, [few], filtered(few))) == []


def driven_part(robot, index):
    """Return an arm that is driven at all joints but one."""
    return load_robot('humanoid_arm', joints=tuple(np.delete(robot.joints, index)))


def driven_run(robot, index, place=None, seed=1):
    """Record all but one joint of an arm, which moves or stands at a place."""
    motion = multisine(robot.joints, 20.0, RATE, seed=seed, base_hz=0.12)
    if place is not None:
        motion = with_joint_at(motion, index, place)
    whole = recorded(ArmModel(robot), motion, seed, torque_noise=0.01, source=f'run_{seed}')
    own = whole.q[:, index]
    return Recording(
        joints=tuple(np.delete(robot.joints, index)),
        t=whole.t,
        q=np.delete(whole.q, index, axis=1),
        tau=np.delete(whole.tau, index, axis=1),
        source=whole.source,
        others=(PositionRange(robot.joints[index], float(own.min()), float(own.max())),),
    )


@pytest.mark.parametrize('position', [0.0, 1.1])
def test_the_described_arm_with_a_joint_held_is_the_whole_arm_with_it_there(robot, position):
    motion = with_joint_at(multisine(robot.joints, 2.0, RATE, seed=3), 3, position)
    expected = np.delete(inverse_dynamics(robot, motion), 3, axis=1)
    held = described_at(
        driven_part(robot, 3).with_gravity([0.3, 0.1, -9.0]), {robot.joints[3]: position}
    )
    np.testing.assert_allclose(held.gravity, [0.3, 0.1, -9.0])
    states = (np.delete(x, 3, axis=1) for x in (motion.q, motion.dq, motion.ddq))
    found = inverse_dynamics(
        held.with_gravity(robot.gravity), type(motion)(held.joints, motion.t, *states)
    )
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_joint_that_mimics_one_that_is_held_follows_it(robot):
    follows = '<mimic joint="jaw" multiplier="2" offset="0.01"/>'
    jaws = ''.join(
        f'<link name="{jaw}_link"><inertial><origin xyz="0 0 0.02"/><mass value="0.03"/>'
        '<inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>'
        f'<joint name="{jaw}" type="prismatic"><parent link="{robot.links[-1]}"/>'
        f'<child link="{jaw}_link"/>{mimic}<limit lower="0.01" upper="0.2" velocity="1" '
        'effort="9"/></joint>'
        for jaw, mimic in (('jaw', ''), ('other_jaw', follows))
    )
    arm = robot_from_urdf(robot.urdf.replace('</robot>', f'{jaws}</robot>'))
    assert [joint.position for joint in held_joints(arm)] == pytest.approx([0.01, 0.03])
    named = described_at(arm, {'jaw': 0.04, 'other_jaw': 0.09}).rigid_parameters
    np.testing.assert_allclose(described_at(arm, {'jaw': 0.04}).rigid_parameters, named)
    np.testing.assert_allclose(described_at(arm, {}).rigid_parameters, arm.rigid_parameters)


@pytest.mark.parametrize('index', [1, 4])
def test_a_joint_that_moves_without_being_driven_is_never_passed_over(robot, index):
    structure, run = ArmModel(driven_part(robot, index)), driven_run(robot, index)
    result = identify(structure, [run], rng=np.random.default_rng(0))
    found = grade(result, structure, [run], {})
    (reason,) = (text for text in found.reasons if 'not driven' in text)
    assert robot.joints[index] in reason and '--joints' in reason
    assert found.word != 'good'


@pytest.mark.parametrize(
    ('index', 'places', 'fact'),
    [(1, [0.9], '0.9 rad'), (4, [-1.2, 1.2], '-1.2'), (1, [0.0], ''), (5, [0.9], '')],
)
def test_a_joint_that_carries_others_and_stands_elsewhere_is_named(robot, index, places, fact):
    """A last joint is a part of the body, wherever it stands."""
    part = driven_part(robot, index)
    motion = multisine(part.joints, 5.0, RATE, seed=2)
    runs = [driven_run(robot, index, place, seed) for seed, place in enumerate(places)]
    found = list(held_elsewhere(part, runs, [motion.with_torque(inverse_dynamics(part, motion))]))
    assert len(found) == bool(fact)
    assert all(robot.joints[index] in one.text and fact in one.text for one in found)


@pytest.fixture(scope='module')
def timed(arm):
    motion = multisine(arm.robot.joints, 20.0, RATE, seed=1, base_hz=0.12)
    made = recorded(arm, motion, torque_noise=0.01, position_noise=1e-4, source='run')
    noise = 0.05 * np.random.default_rng(2).normal(size=motion.dq.shape)
    return replace(made, dq=motion.dq + noise)


def time_faults(recording):
    return [fault.text for fault in velocity_faults(recording) if fault.word != 'good']


def shaken(timed):
    return np.random.default_rng(3).uniform(-0.02, 0.02, len(timed))


@pytest.mark.parametrize('factor', [0.5, 0.9, 1.1, 3.0])
def test_a_wrong_time_is_said(timed, factor):
    (said,) = time_faults(replace(timed, t=factor * timed.t))
    number = re.search(r'(\S+) times', said).group(1)
    assert float(number) == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(
    'change',
    [
        lambda timed: replace(timed, dq=signal.lfilter([0.06], [1.0, -0.94], timed.dq, axis=0)),
        lambda timed: replace(timed, t=np.sort(timed.t + shaken(timed))),
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
