# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a description: which joints are driven, what is refused, arms of others."""

from collections.abc import Callable
import os
from pathlib import Path
from typing import Any

from armid_ros.errors import RobotError
from armid_ros.robots import (
    load_robot,
    parse_gravity,
    read_mounting,
    Robot,
    robot_from_urdf,
    xacro_expansion,
)
import numpy as np
import pinocchio as pin
import pytest

INERTIAL = (
    '<inertial><origin xyz="0.1 0.02 -0.03"/><mass value="1.5"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.015"/></inertial>'
)
LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="40"/>'


def link(name: str, inside: str = INERTIAL) -> str:
    return f'<link name="{name}">{inside}</link>\n'


def joint(name: str, parent: str, child: str, kind: str = 'revolute', inside: str = LIMIT) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 0.3" rpy="0.2 0 0"/><axis xyz="0 1 0"/>{inside}</joint>\n'
    )


def robot(*elements: str) -> str:
    return f'<robot name="made_by_hand">\n{"".join(elements)}</robot>'


BASE = link('base', '')
ARM = BASE + link('upper') + joint('shoulder', 'base', 'upper')
FOREARM = link('lower') + joint('elbow', 'upper', 'lower')
TWO_LINKS = robot(ARM, FOREARM)
MIMICS = robot(
    ARM,
    link('one') + joint('e', 'upper', 'one', inside='<mimic joint="f"/>' + LIMIT),
    link('two') + joint('f', 'upper', 'two', inside='<mimic joint="e"/>' + LIMIT),
)
LOOP = TWO_LINKS.replace('parent link="base"', 'parent link="lower"')


def inverse_dynamics(arm: Any, *state: float) -> np.ndarray:
    """Joint torques of one driven joint at q, dq, ddq."""
    q, dq, ddq = (np.full(arm.n_joints, value) for value in state)
    return np.array(pin.rnea(arm.model, arm.model.createData(), q, dq, ddq))


class TestKinds:
    def test_limits_and_links_are_the_descriptions(self) -> None:
        arm = robot_from_urdf(TWO_LINKS)
        assert arm.name == 'made_by_hand'
        assert (arm.joints, arm.links) == (('shoulder', 'elbow'), ('upper', 'lower'))
        np.testing.assert_array_equal(arm.lower, (-1.0, -1.0))
        np.testing.assert_array_equal(arm.upper, (2.0, 2.0))
        np.testing.assert_array_equal(arm.velocity_limit, (3.0, 3.0))
        np.testing.assert_array_equal(arm.torque_limit, (40.0, 40.0))
        assert arm.torque_units == ('N m', 'N m')

    def test_a_continuous_joint_is_a_revolute_one_without_position_limits(self) -> None:
        turning = robot(ARM, link('lower'), joint('elbow', 'upper', 'lower', 'continuous'))
        arm, limited = robot_from_urdf(turning), robot_from_urdf(TWO_LINKS)
        assert arm.model.nq == 2
        assert (arm.lower[1], arm.upper[1]) == (-np.inf, np.inf)
        assert arm.velocity_limit[1] == 3.0
        np.testing.assert_array_equal(
            inverse_dynamics(arm, 4.0, 1.0, 2.0), inverse_dynamics(limited, 4.0, 1.0, 2.0)
        )

    def test_a_prismatic_joint_lifts_what_it_carries(self) -> None:
        lift = joint('lift', 'base', 'car', 'prismatic').replace('0 1 0', '0 0 2')
        arm = robot_from_urdf(robot(BASE, link('car'), lift.replace('rpy="0.2 0 0"', '')))
        assert arm.prismatic.tolist() == [True]
        assert (arm.position_units, arm.torque_units) == (('m',), ('N',))
        np.testing.assert_allclose(inverse_dynamics(arm, 0.5, 0.0, 2.0), 1.5 * (9.81 + 2.0))

    def test_links_behind_fixed_joints_belong_to_the_body_before_them(self) -> None:
        tool = link('tool') + joint('flange', 'lower', 'tool', 'fixed', '')
        frame = link('tool0', '') + joint('mount', 'tool', 'tool0', 'fixed', '')
        arm = robot_from_urdf(robot(ARM, FOREARM, tool, frame))
        assert arm.n_joints == 2
        assert arm.model.inertias[2].mass == pytest.approx(3.0)

    def test_friction_and_damping_are_kept_but_do_not_act(self) -> None:
        rubbing = '<dynamics damping="0.7" friction="0.2"/>' + LIMIT
        arm = robot_from_urdf(
            robot(BASE, link('upper'), joint('shoulder', 'base', 'upper', inside=rubbing))
        )
        assert (arm.urdf_damping[0], arm.urdf_friction[0]) == (0.7, 0.2)
        for effect in (arm.model.damping, arm.model.friction, arm.model.armature):
            assert not np.any(effect)

    @pytest.mark.parametrize(
        'limit',
        ['', '<limit effort="0" velocity="0"/>', '<limit lower="0" upper="0"/>'],
    )
    def test_a_limit_that_is_not_given_is_infinite_and_noted(self, limit: str) -> None:
        loose = joint('shoulder', 'base', 'upper', inside=limit)
        arm = robot_from_urdf(robot(BASE, link('upper'), loose))
        assert (arm.lower[0], arm.upper[0]) == (-np.inf, np.inf)
        assert arm.velocity_limit[0] == arm.torque_limit[0] == np.inf
        assert any("'shoulder'" in note and 'unlimited' in note for note in arm.notes)

    def test_an_impossible_inertia_is_noted_by_name(self) -> None:
        needle = link('upper', INERTIAL.replace('iyy="0.02"', 'iyy="0.5"'))
        arm = robot_from_urdf(robot(BASE, needle, joint('shoulder', 'base', 'upper')))
        assert any("link 'upper'" in note and 'triangle' in note for note in arm.notes)


class TestDrivenJoints:
    def test_named_joints_come_in_the_robots_own_order(self) -> None:
        arm = robot_from_urdf(TWO_LINKS, joints=['elbow', 'shoulder'])
        assert arm.joints == ('shoulder', 'elbow')

    def test_a_joint_left_out_is_locked_where_zero_or_its_nearest_limit_is(self) -> None:
        bent = joint('elbow', 'upper', 'lower', inside=LIMIT.replace('-1', '0.5'))
        arm = robot_from_urdf(robot(ARM, link('lower'), bent), joints=['shoulder'])
        both = robot_from_urdf(robot(ARM, link('lower'), bent))
        assert any("'elbow'" in note and '0.5 rad' in note for note in arm.notes)
        torque = pin.rnea(
            both.model, both.model.createData(), np.array([0.4, 0.5]), np.zeros(2), np.zeros(2)
        )
        np.testing.assert_allclose(inverse_dynamics(arm, 0.4, 0.0, 0.0)[0], torque[0], rtol=1e-12)

    def test_a_gripper_is_not_driven_unless_named(self) -> None:
        gripper = link('pad') + joint('gripper_slide', 'lower', 'pad', 'prismatic')
        text = robot(ARM, FOREARM, gripper)
        assert robot_from_urdf(text).joints == ('shoulder', 'elbow')
        named = ('shoulder', 'elbow', 'gripper_slide')
        assert robot_from_urdf(text, joints=named).joints == named

    def test_a_joint_of_the_arm_may_have_finger_in_its_name(self) -> None:
        text = robot(ARM, FOREARM).replace('name="shoulder"', 'name="finger_swing"')
        assert robot_from_urdf(text).joints == ('finger_swing', 'elbow')

    def test_mimic_joints_and_what_they_follow_make_a_gripper(self) -> None:
        mimic = '<mimic joint="left" multiplier="-1" offset="0.1"/>' + LIMIT
        hand = (
            link('one')
            + joint('left', 'lower', 'one')
            + link('two')
            + joint('right', 'lower', 'two', inside=mimic)
        )
        arm = robot_from_urdf(robot(ARM, FOREARM, hand))
        assert arm.joints == ('shoulder', 'elbow')
        assert any("'right'" in note and '0.1 rad' in note for note in arm.notes)

    def test_a_mimic_joint_within_the_arm_moves_and_cannot_be_driven(self) -> None:
        mimic = '<mimic joint="shoulder"/>' + LIMIT
        linked = link('lower') + joint('elbow', 'upper', 'lower', inside=mimic)
        wrist = link('hand') + joint('wrist', 'lower', 'hand')
        arm = robot_from_urdf(robot(ARM, linked, wrist))
        assert arm.joints == ('shoulder', 'wrist')
        assert arm.moving == ('shoulder', 'elbow', 'wrist')
        with pytest.raises(RobotError, match="'elbow' is a mimic joint"):
            robot_from_urdf(robot(ARM, linked, wrist), joints=['elbow'])

    @pytest.mark.parametrize(
        ('joints', 'message'),
        [
            (['elbo'], "'elbo'.* shoulder, elbow"),
            (['elbow', 'elbow'], "'elbow'.*twice"),
            ([], 'at least one'),
            (['flange'], "'flange' is fixed.* shoulder, elbow"),
        ],
    )
    def test_names_that_cannot_be_driven(self, joints: list[str], message: str) -> None:
        tool = link('tool') + joint('flange', 'lower', 'tool', 'fixed', '')
        with pytest.raises(RobotError, match=message):
            robot_from_urdf(robot(ARM, FOREARM, tool), joints=joints)


class TestRefused:
    @pytest.mark.parametrize(
        ('text', 'message'),
        [
            ('<robot name="r">\n<link name="a">\n</robot>', 'line 3'),
            ('<mujoco/>', '<mujoco>'),
            ('<mujocoinclude/>', 'MJCF'),
            ('<robot name="r"/>', 'no links'),
            (robot(link('base', ''), link('base', '')), "'base'"),
            (robot(ARM, joint('shoulder', 'base', 'upper')), "'shoulder'"),
            (robot(ARM, joint('elbow', 'upper', 'hand')), "'elbow'.* 'hand'"),
            (robot(ARM, link('loose')), r'\(base, loose\)'),
            (robot(ARM, joint('again', 'base', 'upper')), "'upper'.* two joints"),
            (LOOP, "'upper'.* loop"),
            (robot(ARM, link('l'), joint('free', 'upper', 'l', 'floating')), "'free' is floating"),
            (robot(ARM, link('l'), joint('slide', 'upper', 'l', 'planar')), "'slide' is planar"),
            (robot(ARM, link('l'), joint('odd', 'upper', 'l', 'hinge')), "'odd'.* 'hinge'"),
            (robot(ARM).replace('0 1 0', '0 0 0'), "'shoulder'.* zero vector"),
            (robot(ARM).replace('0 1 0', '0 1'), "'shoulder': xyz='0 1'"),
            (robot(ARM).replace('lower="-1"', 'lower="3"'), "'shoulder'.* lower limit 3"),
            (robot(ARM).replace('"1.5"', '"heavy"'), "'upper': value='heavy'"),
            (robot(ARM).replace('"1.5"', '"-3.2"'), r"'upper'.*-3\.2 kg"),
            (robot(ARM).replace('<mass value="1.5"/>', ''), "'upper'.* <mass>"),
            (robot(ARM).replace('"1.5"', '"inf"'), "'upper': value='inf' of <mass>"),
            (robot(ARM).replace('"0.01"', '"1e101"'), "'upper': ixx='1e101' of <inertia>"),
            (robot(ARM).replace('0 1 0', '1e308 1e308 0'), "'shoulder': xyz='1e308 1e308 0' of"),
            (robot(ARM).replace('0.2 0 0', '0 0 nan'), "'shoulder': rpy='0 0 nan' of <origin>"),
            (robot(ARM).replace('<limit', '<dynamics damping="inf"/><limit'), "damping='inf' of"),
            (MIMICS, "'[ef]' mimics itself"),
            (robot(BASE), 'no joint'),
        ],
    )
    def test_by_name(self, text: str, message: str) -> None:
        with pytest.raises(RobotError, match=message):
            robot_from_urdf(text)

    def test_a_prefix_that_is_not_declared_is_no_fault(self) -> None:
        text = robot(ARM).replace('<limit ', '<limit drake:acceleration="2" ')
        assert robot_from_urdf(text).upper == [2.0]

    def test_a_joint_that_moves_no_mass_is_noted_and_may_be_within_the_arm(self) -> None:
        arm = robot_from_urdf(robot(ARM, link('lower', ''), joint('elbow', 'upper', 'lower')))
        (note,) = arm.notes
        assert all(fact in note for fact in ("'lower'", "'elbow'", '<inertial>'))
        wrist = link('cross', '') + joint('roll', 'upper', 'cross')
        hand = link('hand') + joint('pitch', 'cross', 'hand')
        assert robot_from_urdf(robot(ARM, wrist, hand)).joints == ('shoulder', 'roll', 'pitch')


class TestSources:
    def test_a_file_and_its_text_are_the_same_robot(self, tmp_path: Path) -> None:
        path = tmp_path / 'arm.urdf'
        path.write_text(TWO_LINKS)
        from_file, from_text = load_robot(path), load_robot(TWO_LINKS)
        np.testing.assert_array_equal(from_file.rigid_parameters, from_text.rigid_parameters)
        assert from_file.urdf == from_text.urdf
        assert from_file.path == path

    def test_an_unknown_name_is_answered_with_those_that_exist(self) -> None:
        with pytest.raises(RobotError, match='humanoid_arm, '):
            load_robot('humanoid')
        with pytest.raises(RobotError, match='shoulder, elbow'):
            robot_from_urdf(TWO_LINKS).index('elbo')


class TestGravity:
    @pytest.mark.parametrize(
        ('value', 'vector'),
        [
            ('earth', (0.0, 0.0, -9.81)),
            ('Moon', (0.0, 0.0, -1.62)),
            ('0, 1.5,-9', (0.0, 1.5, -9.0)),
            ([0, 0, 3.7], (0.0, 0.0, 3.7)),
        ],
    )
    def test_as_people_write_it(self, value: Any, vector: tuple[float, ...]) -> None:
        np.testing.assert_array_equal(parse_gravity(value), vector)
        np.testing.assert_array_equal(robot_from_urdf(TWO_LINKS, gravity=value).gravity, vector)

    @pytest.mark.parametrize('value', ['mars', '1,2', '1,2,nan', (1.0, 2.0), 9.81, None])
    def test_what_is_no_gravity_is_refused(self, value: Any) -> None:
        with pytest.raises(RobotError, match='gravity'):
            parse_gravity(value)


class TestRigidParameters:
    def test_they_come_back_as_they_were_given(self) -> None:
        arm = robot_from_urdf(TWO_LINKS)
        wanted = arm.rigid_parameters * np.linspace(0.5, 2.0, 20)
        before = arm.rigid_parameters
        np.testing.assert_allclose(arm.with_inertias(wanted).rigid_parameters, wanted, rtol=1e-12)
        np.testing.assert_array_equal(arm.rigid_parameters, before)

    @pytest.mark.parametrize('mass', [0.0, 1e-157, -1e-40])
    def test_a_moment_without_a_mass_is_refused(self, mass: float) -> None:
        arm = robot_from_urdf(TWO_LINKS)
        without_mass = np.array(arm.rigid_parameters)
        without_mass[10] = mass
        with pytest.raises(RobotError, match="link 'lower'"):
            arm.with_inertias(without_mass)

    def test_a_wrong_number_of_them_is_refused(self) -> None:
        with pytest.raises(RobotError, match='20'):
            robot_from_urdf(TWO_LINKS).with_inertias(np.ones(19))


def test_arrays_cannot_be_written_to() -> None:
    arm = robot_from_urdf(TWO_LINKS)
    for values in (arm.lower, arm.prismatic, arm.gravity, arm.rigid_parameters):
        with pytest.raises(ValueError, match='read-only'):
            values[0] = 1


def test_a_world_that_is_no_link_of_the_file_is_the_ground() -> None:
    weld = joint('weld', 'world', 'base', 'fixed', '')
    arm = robot_from_urdf(robot(weld, ARM, FOREARM))
    plain = robot_from_urdf(robot(link('world', ''), weld, ARM, FOREARM))
    assert arm.joints == ('shoulder', 'elbow')
    np.testing.assert_array_equal(
        inverse_dynamics(arm, 0.3, 0.2, 0.1), inverse_dynamics(plain, 0.3, 0.2, 0.1)
    )
    assert any('world' in note for note in arm.notes)


def test_two_arms_are_said_to_be_two() -> None:
    chains = ''.join(
        link(f'{side}{k}') + joint(f'{side}_{k}', f'{side}{k - 1}' if k else 'torso', f'{side}{k}')
        for side in ('left', 'right')
        for k in range(3)
    )
    torso = BASE + link('torso') + joint('waist', 'base', 'torso')
    head = link('head') + joint('neck', 'torso', 'head')
    (note,) = robot_from_urdf(robot(torso, chains, head)).notes
    assert all(fact in note for fact in ('2 arms', "'left_0' (3", "'right_0'"))
    right = ('waist', 'right_0', 'right_1', 'right_2')
    one = robot_from_urdf(robot(torso, chains, head), joints=right)
    assert not any('arms' in text for text in one.notes)


def test_xacro_arguments_reach_the_file_and_what_it_includes(tmp_path: Path) -> None:
    path = tmp_path / 'arm.xacro'
    (tmp_path / 'forearm.xacro').write_text(robot(FOREARM).replace('1.5', '$(arg mass)'))
    text = robot(ARM, '<xacro:include filename="forearm.xacro"/>')
    text = text.replace('<robot ', '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ')
    text = text.replace('value="1.5"', 'value="$(arg mass)"')
    path.write_text(text.replace('>', '><xacro:arg name="mass" default="1.5"/>', 1))
    heavy = load_robot(f'{path} mass:=4.0')
    np.testing.assert_allclose(heavy.rigid_parameters[::10], 4.0)
    np.testing.assert_allclose(load_robot(path).rigid_parameters[::10], 1.5)
    with pytest.raises(RobotError, match=r"'mass=4'.*:="):
        load_robot(f'{path} other:=1 mass=4')
    (tmp_path / 'arm.urdf').write_text(TWO_LINKS)
    with pytest.raises(RobotError, match='xacro'):
        load_robot(f'{tmp_path}/arm.urdf mass:=4.0')


def tree(n_links: int, kind: str = 'fixed', children: int = 4) -> str:
    """Return a description of a tree of links, with a number of children of each link."""
    body = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    links = ''.join(f'<link name="l{k}">{body}</link>' for k in range(n_links))
    joints = ''.join(
        f'<joint name="j{k}" type="{"continuous" if k == 1 else kind}">'
        f'<parent link="l{(k - 1) // children}"/><child link="l{k}"/>'
        '<limit velocity="1" effort="1" lower="-1" upper="1"/></joint>'
        for k in range(1, n_links)
    )
    return f'<robot name="tree">{links}{joints}</robot>'


class TestSizes:
    """Large descriptions are read or refused; none ends the process."""

    def test_thousands_of_links_are_read(self) -> None:
        assert load_robot(tree(3000)).n_joints == 1

    def test_a_chain_too_long_for_recursion_is_refused(self) -> None:
        with pytest.raises(RobotError, match="'l19999'"):
            load_robot(tree(20_000, children=1))

    def test_more_driven_joints_than_memory_has_room_for_are_refused(self) -> None:
        with pytest.raises(RobotError, match=r'999 .*150'):
            load_robot(tree(1000, 'revolute'))


class TestXacroIsAProgram:
    """It has limits of time and memory, and only a file that a person names is expanded."""

    @staticmethod
    def text(inside: str) -> str:
        head = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="r"><link name="l"/>'
        return f'{head}{inside}</robot>'

    def test_one_without_end_or_with_all_memory_is_stopped(
        self, tmp_path: Path, monkeypatch
    ) -> None:
        path = tmp_path / 'endless.xacro'
        path.write_text(self.text('<xacro:property name="x" value="${\'x\' * 10**10}"/>${x}'))
        with pytest.raises(RobotError, match=r'endless\.xacro'):
            load_robot(path)
        path.write_text(self.text(f'<xacro:include filename="{tmp_path}/fifo"/>'))
        os.mkfifo(tmp_path / 'fifo')
        monkeypatch.setattr(xacro_expansion, 'ELAPSED_LIMIT', 1.5)
        with pytest.raises(RobotError, match=r'endless\.xacro.*1\.5 s'):
            load_robot(path)

    def test_a_text_is_never_expanded(self) -> None:
        with pytest.raises(RobotError, match='no joint'):
            load_robot(self.text('<xacro:include filename="/etc/passwd"/>'))


def floor_of(folder: Path, text: str | None) -> Any:
    """Return what the file beside a description states about its mounting."""
    path = folder / 'arm.xml'
    path.write_text(TWO_LINKS)
    if text is not None:
        (folder / 'arm.mounting.yaml').write_text(text)
    return read_mounting(load_robot(path))


def test_a_height_or_none_is_read(tmp_path: Path) -> None:
    assert read_mounting(robot_from_urdf(TWO_LINKS)) is None
    assert floor_of(tmp_path, None) is None
    assert floor_of(tmp_path, 'floor: -0.75')[0] == -0.75
    assert floor_of(tmp_path, 'floor: none')[0] is None
    for text in ('floor: low', 'floor: true', 'floor: .nan', 'height: 1', '[', ''):
        with pytest.raises(RobotError, match=r'arm\.mounting\.yaml'):
            floor_of(tmp_path, text)


ARMS = {
    'TwoDofs.urdf': 2,
    'borinot_flying_arm_2.urdf': 2,
    'double_pendulum.urdf': 2,
    'double_pendulum_continuous.urdf': 2,
    'finger_edu.urdf': 3,
    'kinova.urdf': 6,
    'panda.urdf': 7,
    'so100.urdf': 5,
    'talos_left_arm.urdf': 6,
    'tiago_no_hand.urdf': 12,
    'ur3_robot.urdf': 6,
    'ur5_gripper.urdf': 6,
    'ur10_robot.urdf': 6,
    'xarm7.urdf': 7,
    'z1.urdf': 6,
    'baxter.urdf': 15,
}

FindRobot = Callable[[str], Path]


def random_states(robot: Robot, count: int) -> np.ndarray:
    """Return q, dq, ddq of each sample, shape (count, 3, n)."""
    states = np.random.default_rng(3).standard_normal((count, 3, robot.n_joints))
    return states * np.array((2.0, 3.0, 10.0))[:, None]


@pytest.mark.parametrize(('name', 'n_joints'), ARMS.items())
def test_regressor_times_parameters_is_inverse_dynamics(
    name: str, n_joints: int, example_robot: FindRobot
) -> None:
    robot = load_robot(example_robot(name), gravity=(0.5, -3.0, -9.0))
    assert robot.n_joints == robot.model.nq == robot.model.nv == n_joints
    data = robot.model.createData()
    for q, dq, ddq in random_states(robot, 20):
        tau = pin.rnea(robot.model, data, q, dq, ddq).copy()
        regressor = pin.computeJointTorqueRegressor(robot.model, data, q, dq, ddq)
        error = np.linalg.norm(regressor @ robot.rigid_parameters - tau)
        assert error <= 1e-9 * np.linalg.norm(tau)


def test_the_panda_is_seven_joints_and_a_closed_hand(example_robot: FindRobot) -> None:
    robot = load_robot(example_robot('panda.urdf'))
    assert robot.joints == tuple(f'panda_joint{number}' for number in range(1, 8))
    assert robot.links == tuple(f'panda_link{number}' for number in range(1, 8))
    assert any('panda_finger_joint2' in note and ' 0 m' in note for note in robot.notes)


def test_a_link_may_have_the_name_of_its_joint(example_robot: FindRobot) -> None:
    everything = ('shoulder_pan', 'shoulder_lift', 'elbow_flex', 'wrist_flex', 'wrist_roll')
    robot = load_robot(example_robot('so100.urdf'), joints=(*everything, 'gripper'))
    assert robot.joints == (*everything, 'gripper')
