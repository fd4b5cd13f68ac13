# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a motion does not teach is said, with the joint and how to move it."""

from __future__ import annotations

from dataclasses import replace

from armid_ros.estimate import Estimate
from armid_ros.identification.online.identifier import OnlineIdentifier
from armid_ros.identification.online.learning_progress import LearningProgress, too_little_motion
import numpy as np
import pytest

from tests.identification.conftest import multisine


def learn(arm, standing=None, look_every=1.0):
    """Identify online while a joint may stand still, look every second, return the last answer."""
    motion = multisine(arm.robot.joints, 30.0, 250.0, seed=0)
    if standing is not None:
        moves = np.array(arm.robot.joints) != standing
        q = np.where(moves, motion.q, 0.4)
        motion = replace(motion, q=q, dq=moves * motion.dq, ddq=moves * motion.ddq)
    rng = np.random.default_rng(0)
    tau = arm.torque(motion) + 0.02 * rng.normal(size=motion.q.shape)
    online = OnlineIdentifier(replace(arm, values=()), rng=np.random.default_rng(0))
    progress = LearningProgress(online.arm, online.base, np.random.default_rng(0))
    said, due = {}, look_every
    for t, q, torque in zip(motion.t, motion.q, tau, strict=True):
        online.update(t, q, None, torque)
        if t > due and online.samples:
            said, due = progress.unidentified(t, online.estimate()), due + look_every
    return said


@pytest.mark.long
def test_a_joint_that_stands_still_is_named(arm):
    said = learn(arm, standing='elbow_pitch')
    text = too_little_motion({'elbow_pitch': said['elbow_pitch']})
    assert 'elbow_pitch' in text and 'viscous friction' in text


@pytest.mark.long
@pytest.mark.slow
def test_a_rich_motion_leaves_the_strong_joints_with_nothing_to_ask_for(arm):
    strong = {'shoulder_pitch', 'shoulder_roll', 'upper_arm_yaw', 'elbow_pitch'}
    assert not strong & learn(arm).keys()


@pytest.fixture
def started(arm):
    """Return the progress of an identifier, and its first estimate."""
    online = OnlineIdentifier(arm, rng=np.random.default_rng(0))
    progress = LearningProgress(online.arm, online.base, np.random.default_rng(0))
    return progress, online.estimate()


def test_while_the_estimate_gets_better_nothing_is_asked_for(started):
    progress, start = started
    for second in range(30):
        better = Estimate(start.parameters, start.values, start.covariance * 0.8**second)
        assert not progress.unidentified(float(second), better)
    worse = [progress.unidentified(30.0 + second, better) for second in range(30)]
    assert worse[-1]


@pytest.mark.parametrize(('friction', 'named'), [(0.2, False), (0.0, True)])
def test_what_a_joint_takes_includes_its_friction(started, friction, named):
    """The links beyond the wrist take 0.007 N m; 0.005 N m is much of that, little of 0.2 N m."""
    progress, start = started
    values, std = 0.0 * start.values, np.full(len(start.values), 1e-9)
    wrist = start.index('coulomb_torque', 'wrist_pitch')
    values[wrist], std[wrist] = friction, 0.005
    said = {}
    for second in range(12):
        said = progress.unidentified(
            float(second), Estimate(start.parameters, values, np.diag(std**2))
        )
    assert list(said) == (['wrist_pitch'] if named else [])
