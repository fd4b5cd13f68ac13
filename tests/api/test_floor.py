# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A plan of Python keeps clear of the same floor and surroundings as one of the command."""

from dataclasses import replace

import armid_ros as ar
from armid_ros.errors import ModelError, RobotError, TrajectoryError
import numpy as np
import pytest

QUICK = {'duration': 6.0, 'starts': 1, 'iterations': 1, 'candidates': 5}


def test_a_plan_is_checked_against_floor_and_environment(tmp_path):
    plan = ar.design_excitation('humanoid_arm', **QUICK)
    assert plan.scene.floor.height is not None
    assert [o.kind for o in plan.scene.obstacles] == ['plane']
    box = tmp_path / 'box.yaml'
    box.write_text('- {name: crate, kind: box, size: [9, 9, 0.1], position: [0, 0, -2]}\n')
    plan = ar.design_excitation('humanoid_arm', floor='none', environment=box, **QUICK)
    assert [o.name for o in plan.scene.obstacles] == ['crate']


@pytest.mark.parametrize('floor', [5.0, 'high'])
def test_a_floor_that_cannot_be_is_refused(floor):
    with pytest.raises(TrajectoryError, match='floor'):
        ar.design_excitation('humanoid_arm', floor=floor, **QUICK)


def test_velocity_limits_of_python_hold_and_missing_ones_are_named():
    shipped = ar.load_robot('humanoid_arm')
    robot = replace(shipped, velocity_limit=np.r_[0.0, shipped.velocity_limit[1:]])
    plan = ar.design_excitation(robot, speed='fast', **QUICK)
    assert f'velocity of {robot.joints[0]}' in repr(plan)
    limits = {robot.joints[0]: 0.3}
    plan = ar.design_excitation(robot, speed='fast', joint_limits=limits, **QUICK)
    assert np.abs(plan.motion().dq[:, 0]).max() <= 0.3
    assert 'velocity' not in '\n'.join(plan.summary().lines)


def test_wheels_are_not_driven_by_a_script(tmp_path):
    path = tmp_path / 'rover.urdf'
    text = ar.load_robot('humanoid_arm').urdf
    wheel = (
        '<link name="tyre"/><joint name="wheel" type="continuous"><parent link="torso"/>'
        '<child link="tyre"/><axis xyz="0 1 0"/><limit velocity="2" effort="9"/></joint></robot>'
    )
    path.write_text(text.replace('</robot>', wheel))
    with pytest.raises(TrajectoryError, match=r'wheel.*joints=\['):
        ar.design_excitation(path, **QUICK)


@pytest.mark.parametrize(
    ('start', 'answer'), [([0.0], r'shape \(1,\)'), ([0, 0, 0, 90, 0, 0], 'are these degrees')]
)
def test_a_start_of_wrong_length_or_in_degrees_is_an_error(start, answer):
    with pytest.raises(TrajectoryError, match=f'start.*{answer}'):
        ar.design_excitation('humanoid_arm', start=start, **QUICK)


def test_an_effect_is_given_once():
    effect = 'payload@wrist_pitch:payload_m=0.9'
    with pytest.raises(ModelError, match='twice'):
        ar.ArmModel.of('humanoid_arm', effects=(effect, effect))
    with pytest.raises(RobotError, match='NAME:=VALUE'):
        ar.load_robot('arm.xacro hand=false')
