# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What jogs or slow motions do not determine stays as described."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.identification import grade, identify, Score
from armid_ros.identification.fitting.identifiability import base_spread, NOT_SHOWN
import numpy as np
import pytest

from ..conftest import multisine, recorded

NOISE = 0.002


def jogs(arm, seed):
    """Record one joint after the other, ten seconds each, with the others at rest."""
    joints = arm.robot.joints
    pose = np.array([0.2, -0.4, 0.3, -0.5, 0.1, 0.4])
    for k in range(len(joints)):
        motion = multisine(joints, 10.0, 100.0, seed=seed + k, amplitude=0.4, base_hz=0.2)
        alone = np.arange(len(joints)) == k
        q = np.where(alone, motion.q, pose)
        moved = replace(motion, q=q, dq=alone * motion.dq, ddq=alone * motion.ddq)
        yield recorded(arm, moved, k, NOISE, 2e-5, source=f'jog {k}')


@pytest.fixture(scope='module')
def real(arm):
    """Return an arm whose links are up to a fifth lighter or heavier than described."""
    masses = np.random.default_rng(1).uniform(0.8, 1.2, (6, 1))
    links = (arm.robot.rigid_parameters.reshape(-1, 10) * masses).ravel()
    return replace(arm, robot=arm.robot.with_inertias(links))


@pytest.fixture(scope='module')
def recordings(real):
    return [*jogs(real, 3), *jogs(real, 4)]


@pytest.fixture(scope='module')
def found(structure, recordings):
    return identify(structure, recordings, rng=np.random.default_rng(0))


@pytest.mark.slow
def test_a_model_of_jogs_predicts_joints_that_move_at_once(real, found):
    """The first joints are off by twice and three times as much where all is fitted."""
    motion = multisine(real.robot.joints, 20.0, 100.0, seed=11)
    together = recorded(real, motion, 1, NOISE, 2e-5)
    errors = Score.of(found.predict([together])).joint_relative_error_percent
    assert errors[:2].max() < 3.0


def test_what_is_held_is_said_stays_as_described_and_condemns_no_grade(
    structure, recordings, found
):
    """No value is less certain than the description."""
    theory = found.theory
    named = [one for one in found.unidentified if one.reason == NOT_SHOWN]
    assert named and all('coefficient' not in one.parameter.name for one in named)
    assert grade(found, structure, recordings, {}).word != 'unusable'
    assert np.all(found.estimate.std <= base_spread(structure, found.base))
    held = ~found.base.grouping[:, theory.independent].any(axis=0)
    assert held.any()
    now, then = (theory.values(arm.theta) for arm in (found.arm, structure))
    np.testing.assert_allclose(now[held], then[held], atol=1e-9)


def test_a_motion_of_all_joints_holds_nothing(structure, real):
    rich = recorded(real, multisine(real.robot.joints, 60.0, 100.0, seed=5), 0, NOISE, 2e-5)
    found = identify(structure, [rich], rng=np.random.default_rng(0))
    assert found.base.rank == found.theory.rank


@pytest.fixture(scope='module', params=[9.81, 1.62], ids=['earth', 'moon'])
def slow(arm, request):
    """Return an arm and a slow motion of it."""
    robot = arm.robot.with_gravity(np.array([0.0, 0.0, -request.param]))
    motion = multisine(robot.joints, 40.0, 100.0, seed=3, amplitude=0.7, base_hz=0.05)
    return replace(arm, robot=robot), motion


def weighed(truth, description, motion, noise=0.0):
    structure = ArmModel(description, truth.effects, quasi_static=True)
    recording = recorded(truth, motion, 1, noise)
    return recording, identify(structure, [recording], rng=np.random.default_rng(0))


def inside(result, truth):
    """Count composites within 95 %, and all of them."""
    rigid = [k for k, name in enumerate(result.estimate.parameters) if name.rigid]
    off = (result.estimate.values - result.base.values(truth.theta)) / result.estimate.std
    return int(np.sum(np.abs(off[rigid]) < 1.96)), len(rigid)


@pytest.mark.parametrize('seed', [None, 0, 1])
def test_composites_are_inside_their_intervals_whatever_the_described_inertia(slow, seed):
    """Second moments are as described, or off by up to 40 %, masses by 10 %."""
    truth, motion = slow
    bodies = truth.robot.rigid_parameters.reshape(-1, 10).copy()
    if seed is not None:
        rng = np.random.default_rng(seed)
        bodies[:, 4:] *= rng.uniform(0.6, 1.4, (6, 1))
        bodies *= rng.uniform(0.9, 1.1, (6, 1))
    recording, result = weighed(truth, truth.robot.with_inertias(bodies.ravel()), motion)
    assert inside(result, truth) == (12, 12)
    assert any('too fast' in note for note in result.notes)
    if seed is None:
        for fits in (result.training, result.predict([recording])):
            assert Score.of(fits).relative_error_percent < 0.01


def test_a_motion_that_is_slow_enough_says_nothing(arm):
    motion = multisine(arm.robot.joints, 500.0, 4.0, seed=3, amplitude=0.7, base_hz=0.002)
    _, result = weighed(arm, arm.robot, motion, noise=0.02)
    assert not any('too fast' in note for note in result.notes)
    found, count = inside(result, arm)
    assert found >= count - 3
