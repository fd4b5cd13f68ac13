# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An encoder that reads the same while its joint moves is dead; a joint that is held is not."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.identification import grade, identify
from armid_ros.identification.assess.sensor_faults import encoder_faults
from armid_ros.inspection import inspect
from armid_ros.recording import Recording
import numpy as np
import pytest

from ..conftest import multisine

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
    remarks = [one.text for one in inspect(turning, rng=np.random.default_rng(0)).remarks]
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
        assert ('dead' in ' '.join(found.reasons)) == (word == 'unusable')


def test_inspection_says_so_with_and_without_a_robot(arm, blind, locked):
    for robot in (arm.robot, None):
        found = inspect(blind, robot, rng=np.random.default_rng(0))
        assert found.remarks[0].weight == 'bad'
        assert 'dead' in found.remarks[0].text
        sound = inspect(locked, robot, rng=np.random.default_rng(0))
        assert not any(remark.weight == 'bad' for remark in sound.remarks)
