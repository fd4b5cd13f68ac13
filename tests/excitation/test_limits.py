# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Limits, and where motions exceed them."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.api.design import design_excitation
from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    check_limits,
    CollisionScene,
    Design,
    DesignSettings,
    Excitation,
    FourierTrajectory,
    Limits,
    random_feasible,
    with_joint_limits,
)
from armid_ros.excitation.feasibility import trajectory_faults
from armid_ros.excitation.limits import SLOW_VELOCITY, TIME_TO_TOP_SPEED
from armid_ros.robots import joints_beside_arms, load_arms, robot_from_urdf
import numpy as np
import pytest

from .conftest import urdf


@pytest.fixture
def swing(two_link):
    """Both joints, 1 rad to either side in 10 s."""
    w = 2 * np.pi / 10.0
    return FourierTrajectory(
        two_link.joints, 10.0, np.zeros(2), np.full((2, 1), w), np.zeros((2, 1))
    )


@pytest.fixture
def limits(two_link):
    return Limits.of(two_link)


@pytest.mark.parametrize(
    ('change', 'limit', 'value', 'time'),
    [
        ({'upper': [2.0, 0.9]}, 'upper position', 1.0, 2.5),
        ({'lower': [-2.0, -0.5]}, 'lower position', -1.0, 7.5),
        ({'velocity': [2.0, 0.5]}, 'velocity', 2 * np.pi / 10, 0.0),
        ({'acceleration': [9.0, 0.2]}, 'acceleration', -((2 * np.pi / 10) ** 2), 2.5),
    ],
)
def test_violation_names_joint_limit_time_and_value(limits, swing, change, limit, value, time):
    tighter = replace(limits, **{name: np.array(v) for name, v in change.items()})
    (violation,) = check_limits(tighter, swing.one_period(200))
    assert (violation.joint, violation.limit) == ('elbow', limit)
    assert violation.value == pytest.approx(value)
    assert violation.time == pytest.approx(time, abs=0.1)
    assert 'elbow' in str(violation) and limit in str(violation)


def test_a_position_uses_its_limits_by_the_distance_from_the_middle(limits, swing, two_link):
    """A short way beside one end of the range is near a limit; one without an end uses none."""
    motion = swing.one_period(200)  # the joints stay within 1 rad
    beside = replace(limits, lower=np.array([-9.0, -np.inf]), upper=np.array([1.0, np.inf]))
    design = SimpleNamespace(
        excitation=Excitation(swing), limits=beside, settings=DesignSettings()
    )
    shares = Design.limits_used(design, ArmModel(two_link))
    np.testing.assert_allclose(shares['position'], [1.0, 0.0], atol=1e-3)
    assert not any(fault.joint == 'shoulder' for fault in check_limits(beside, motion))


def test_torque_is_compared_with_its_limit(limits, swing, two_link):
    motion = swing.one_period(200)
    torque = ArmModel(two_link).torque(motion)
    assert check_limits(limits, motion, torque) == ()
    weak = replace(limits, torque=np.array([0.9, 2.0]) * np.abs(torque).max(axis=0))
    (violation,) = check_limits(weak, motion, torque)
    assert (violation.joint, violation.limit, violation.unit) == ('shoulder', 'torque', 'N m')


def test_peak_between_the_samples_is_found(limits, swing, two_link):
    between = swing.shifted(0.3 * 10.0 / 200)
    tight = replace(limits, upper=np.array([2.0, 1.0 - 1e-9]))
    assert not check_limits(tight, between.one_period(200))
    assert trajectory_faults(ArmModel(two_link), tight, between, None)


def test_joints_of_another_robot_are_refused(limits, swing):
    other = replace(swing.one_period(10), joints=('elbow', 'shoulder'))
    with pytest.raises(TrajectoryError, match='elbow, shoulder'):
        check_limits(limits, other)


def test_speed_classes_use_a_growing_share_of_the_rates(two_link):
    slow, medium, fast = (Limits.of(two_link, speed=s) for s in ('slow', 'medium', 'fast'))
    assert np.all(slow.velocity < medium.velocity)
    assert np.all(medium.velocity < fast.velocity)
    assert np.all(fast.velocity < two_link.velocity_limit)
    np.testing.assert_array_equal(slow.upper, fast.upper)
    np.testing.assert_allclose(Limits.of(two_link, speed=0.5).velocity, 1.0)


@pytest.mark.parametrize(
    ('speed', 'message'), [('warp', 'slow, medium, fast'), (1.5, 'at most 1')]
)
def test_unknown_speed_is_refused(two_link, speed, message):
    with pytest.raises(TrajectoryError, match=message):
        Limits.of(two_link, speed=speed)


def test_limits_without_room_are_refused_with_the_joint(limits):
    with pytest.raises(TrajectoryError, match=r'elbow.*below its upper'):
        replace(limits, lower=np.array([-1.0, 1.0]), upper=np.array([1.0, 1.0]))
    with pytest.raises(TrajectoryError, match=r'shoulder.*velocity'):
        replace(limits, velocity=np.array([0.0, 1.0]))


def arm_urdf(name='small', limit=2.0):
    """Write an arm of three joints that stands."""
    return urdf(
        ('waist', 'revolute', 'base', 'a', '0 0 0.5', '0 0 1', -limit, limit, 200),
        ('shoulder', 'revolute', 'a', 'b', '0 0 0.4', '0 1 0', -1, 1, 100),
        ('elbow', 'revolute', 'b', 'c', '0 0 0.4', '0 1 0', -1, 1, 50),
        name=name,
    )


@pytest.mark.parametrize('given', ['velocity="0"', '', 'velocity="inf"'])
def test_a_joint_without_a_velocity_limit_is_slow_and_that_is_said(given):
    text = arm_urdf().replace('velocity="2"', given, 1)
    robot = robot_from_urdf(text)
    limits = Limits.of(robot, speed=1.0)
    np.testing.assert_allclose(limits.velocity, [SLOW_VELOCITY, 2.0, 2.0])
    np.testing.assert_allclose(limits.acceleration, limits.velocity / TIME_TO_TOP_SPEED)
    assert any('waist' in line for line in CollisionScene.of(robot, 0.01).unchecked)
    mended = with_joint_limits(robot, velocity=['waist:=1.5'])
    assert Limits.of(mended, speed=1.0).velocity[0] == 1.5
    assert not any('velocity' in line for line in CollisionScene.of(mended, 0.01).unchecked)


@pytest.mark.parametrize(
    'text', ['waist', 'wrist:=1', 'waist:=0', 'waist:=-1', 'waist:=nan', 'waist:=']
)
def test_a_velocity_that_is_none_is_refused(text):
    with pytest.raises(TrajectoryError, match='waist'):
        with_joint_limits(robot_from_urdf(arm_urdf()), velocity=[text])


@pytest.mark.parametrize(
    ('value', 'hint'), [(2.1, False), (90.0, True), (150.0, False)]
)  # 90 degrees/s are 1.57 rad/s, 150 degrees/s 2.6
def test_a_given_velocity_cannot_exceed_that_of_the_description(value, hint):
    with pytest.raises(TrajectoryError, match=r'waist.*exceeds the limit of 2 rad/s') as caught:
        with_joint_limits(robot_from_urdf(arm_urdf()), velocity=[f'waist:={value}'])
    assert ('degrees' in str(caught.value)) == hint


def test_a_given_acceleration_cannot_exceed_that_of_the_file(tmp_path):
    path = tmp_path / 'joint_limits.yaml'
    entry = 'has_acceleration_limits: true, max_acceleration: 3.0'
    path.write_text(f'joint_limits: {{waist: {{{entry}}}}}')
    robot = robot_from_urdf(arm_urdf())
    with pytest.raises(TrajectoryError, match=r'waist.*acceleration.*3 rad/s\^2'):
        design_excitation(robot, joint_limits=path, acceleration=np.full(3, 4.0))


def test_limits_in_degrees_are_asked_about():
    with pytest.raises(TrajectoryError, match=r'waist.*160.*degrees'):
        CollisionScene.of(robot_from_urdf(arm_urdf(limit=160.0)), 0.01)


def test_moveit_limits_are_read(tmp_path):
    path = tmp_path / 'joint_limits.yaml'
    path.write_text(
        'joint_limits:\n'
        '  waist: {has_velocity_limits: true, max_velocity: 1.0, has_acceleration_limits: true, '
        'max_acceleration: 3.0}\n'
        '  shoulder: {has_velocity_limits: true, max_velocity: 9.0, has_acceleration_limits: '
        'false, max_acceleration: 0}\n'
    )
    robot = with_joint_limits(robot_from_urdf(arm_urdf()), path)
    limits = Limits.of(robot, speed=1.0)
    np.testing.assert_allclose(limits.velocity, [1.0, 2.0, 2.0])
    np.testing.assert_allclose(limits.acceleration, [3.0, 8.0, 8.0])
    path.write_text('joint_limits: {waist: {has_acceleration_limits: true}}')
    with pytest.raises(TrajectoryError, match='waist: max_acceleration'):
        with_joint_limits(robot, path)


@pytest.mark.parametrize(
    ('least', 'most', 'lower', 'upper'), [(-0.5, 0.7, -0.5, 0.7), (-9, 9, -2, 2)]
)
def test_moveit_position_limits_narrow_those_of_the_description(
    tmp_path, least, most, lower, upper
):
    path = tmp_path / 'joint_limits.yaml'
    limits = f'has_position_limits: true, min_position: {least}, max_position: {most}'
    path.write_text(f'joint_limits: {{waist: {{{limits}}}, shoulder: }}')  # null: none
    robot = with_joint_limits(robot_from_urdf(arm_urdf(limit=2.0)), path)
    np.testing.assert_array_equal(robot.lower, [lower, -1, -1])
    np.testing.assert_array_equal(robot.upper, [upper, 1, 1])
    found = random_feasible(
        ArmModel(robot), Limits.of(robot, speed=1.0), 4.0, 2, np.random.default_rng(0)
    )
    q = Excitation(found, 1, 2.0).motion(100.0).q
    assert np.all((q >= robot.lower) & (q <= robot.upper))
    assert np.ptp(q[:, 0]) > 0.2 * (upper - lower)


@pytest.mark.parametrize(
    ('entry', 'named'),
    [
        ('waist: {has_position_limits: true, min_position: -1}', 'waist: max_position'),
        ('waist: {has_position_limits: true, min_position: 3, max_position: 4}', 'waist'),
        ('elbow_1: {has_velocity_limits: true, max_velocity: 1}', 'waist, shoulder'),
    ],
)
def test_a_file_of_limits_that_leave_nothing_is_refused(tmp_path, entry, named):
    path = tmp_path / 'joint_limits.yaml'
    path.write_text(f'joint_limits: {{{entry}}}')
    with pytest.raises(TrajectoryError, match=named):
        with_joint_limits(robot_from_urdf(arm_urdf(limit=2.0)), path)


def test_wheels_head_and_torso_belong_to_no_arm():
    parts = [('torso', 'revolute', 'base', 'trunk', '0 0 0.5', '0 0 1', -1, 1, 200)]
    parts += [
        (f'wheel{k}', 'continuous', 'base', f'tyre{k}', f'{k} 0 0', '0 1 0', 0, 0, 9)
        for k in range(2)
    ]
    parts.append(('head', 'revolute', 'trunk', 'skull', '0 0 0.5', '0 0 1', -1, 1, 9))
    arms = []
    for side in ('left', 'right'):
        parent = 'trunk'
        for k in range(3):
            name = f'{side}{k}'
            parts.append((name, 'revolute', parent, f'{name}_link', '0 0 0.3', '0 1 0', -1, 1, 9))
            parent = f'{name}_link'
            arms.append(name)
    robot = robot_from_urdf(urdf(*parts))
    assert set(robot.joints) - set(joints_beside_arms(robot)) == set(arms)
    loaded, others = load_arms(lambda joints: robot_from_urdf(urdf(*parts), joints=joints), None)
    assert set(loaded.joints) == set(arms) and set(others).isdisjoint(arms)
    one = [part for part in parts if not part[0].startswith('left')]
    robot = robot_from_urdf(urdf(*one))
    assert set(joints_beside_arms(robot)) == {'wheel0', 'wheel1', 'head'}
    assert joints_beside_arms(robot_from_urdf(urdf(*parts[1:3]))) == ()
