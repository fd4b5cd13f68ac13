# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo hides in the arm shows in the torque, is possible, and is revealed in the end."""

from armid_ros.api.diagnosis import diagnose
from armid_ros.cli.demo.steps import hidden_change, outcome, ROBOT, story, true_arm
from armid_ros.effects import parse_effect
from armid_ros.errors import ModelError
from armid_ros.excitation import ClearanceModel, Limits, random_feasible
from armid_ros.robots import collision_model, load_robot
import numpy as np
import pytest

from tests.diagnosis.conftest import Bench


@pytest.fixture(scope='module')
def robot():
    return load_robot(ROBOT, gravity='moon')


def test_every_change_shows_in_the_torque_and_is_possible(robot):
    arm, rng = true_arm(robot), np.random.default_rng(0)
    bodies = ClearanceModel.of(collision_model(robot))
    drawn = random_feasible(arm, Limits.of(robot), 8.0, 5, rng, clearance=bodies)
    motion = drawn.one_period(400)
    whole = arm.torque(motion)
    drawn = (hidden_change(arm, rng) for _ in range(100))
    every = {str(one.effects[-1]): one for one in drawn}
    assert len(every) > 10
    for effect, changed in every.items():
        lower, upper = changed.effects[-1].bounds()
        assert np.all((changed.values[-1] >= lower) & (changed.values[-1] <= upper))
        difference = changed.torque(motion) - whole
        share = np.sqrt(np.mean(difference**2, axis=0) / np.mean(whole**2, axis=0))
        assert 0.1 < share.max() < 1.0, effect


def test_what_is_asked_for_is_hidden(robot):
    arm, rng = true_arm(robot), np.random.default_rng(0)
    drawn = (hidden_change(arm, rng, 'viscous_friction') for _ in range(20))
    assert {one.effects[-1].joints for one in drawn} == {('upper_arm_yaw',), ('elbow_pitch',)}
    asked = 'stribeck_friction@wrist_pitch:stribeck_torque=0.1'
    assert hidden_change(arm, rng, asked).values[-1].tolist() == [0.1]
    with pytest.raises(ModelError, match='stribeck_friction@elbow_pitch'):
        hidden_change(arm, rng, 'torque_gain@wrist')


def test_it_is_revealed_in_the_end():
    bench = Bench()
    spring_at_elbow = parse_effect('joint_spring@elbow:spring_stiffness=2', bench.robot)
    changed = bench.arm.with_effect(*spring_at_elbow)

    def spring(motion, _):
        return changed.torque(motion) - bench.arm.torque(motion)

    recordings = bench.recordings(spring)
    found = diagnose(
        bench.arm,
        recordings[:2],
        validate=recordings[2:],
        baseline=bench.recordings(seed=3),
        rng=0,
    )
    assert 'joint spring in elbow' in outcome(changed, found)
    told = story(changed, found)
    assert told['found']
    gap = told['gap']
    assert gap['after']['elbow'] < 0.2 * gap['before']['elbow']
