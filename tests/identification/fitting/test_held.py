# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What joints that are moved one after the other do not determine stays as described."""

from dataclasses import replace

from armid_ros.identification import grade, identify
from armid_ros.identification.fitting.identifiability import base_spread, NOT_SHOWN
from armid_ros.identification.rows.regression import Score
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
