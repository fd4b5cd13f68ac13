# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Descriptions as vendors publish them: in packages, with arguments, drives and simulators."""

import os

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.errors import RobotError
from armid_ros.robots import collision_model, load_robot, xacro_expansion
import pytest

from tests.cli.conftest import armid

XACRO = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm">'
INERTIAL = (
    '<inertial><mass value="${mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    '</inertial>'
)
ARM = f"""{XACRO}
<xacro:arg name="prefix" default="left_"/>
<xacro:include filename="$(find arm_description)/urdf/macro.xacro"/>
<xacro:include filename="$(find arm_resources)/mass.xacro"/>
<xacro:include filename="$(find arm_driver)/urdf/arm.ros2_control.xacro"/>
<xacro:arm prefix="$(arg prefix)"/>
<xacro:arm_ros2_control host="10.0.0.1"/>
<ros2_control name="arm"><hardware>
  <param name="script">$(find arm_client)/resources/control.script</param>
</hardware></ros2_control>
<gazebo><plugin><parameters>$(find arm_bringup)/config/drives.yaml</parameters></plugin></gazebo>
</robot>"""
MACRO = f"""{XACRO}<xacro:macro name="arm" params="prefix">
<link name="base"/>
<link name="${{prefix}}link">{INERTIAL}<collision><geometry>
  <mesh filename="package://arm_resources/meshes/link.obj"/></geometry></collision></link>
<joint name="${{prefix}}joint" type="revolute"><parent link="base"/><child link="${{prefix}}link"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</xacro:macro></robot>"""
CUBE = ''.join(f'v {x} {y} {z}\n' for x in (0, 1) for y in (0, 1) for z in (0, 1)) + (
    'f 1 2 4\nf 1 4 3\nf 5 7 8\nf 5 8 6\nf 1 5 6\nf 1 6 2\nf 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5\n'
    'f 2 6 8\nf 2 8 4\n'
)


def package(folder, name, files):
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    (folder / 'package.xml').write_text(f'<package><name> {name} </name></package>')
    return folder


@pytest.fixture
def workspace(tmp_path, monkeypatch):
    """Return an empty folder, and see no packages of the machine."""
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    monkeypatch.delenv('ROS_PACKAGE_PATH', raising=False)
    return tmp_path


def description(folder):
    package(folder, 'arm_description', {'urdf/arm.xacro': ARM, 'urdf/macro.xacro': MACRO})
    return folder / 'urdf' / 'arm.xacro'


RESOURCES = {
    'mass.xacro': f'{XACRO}<xacro:property name="mass" value="2.5"/></robot>',
    'meshes/link.obj': CUBE,
}
#: Where the description and the package that it needs are.
LAYOUTS = {
    'beside it': ('repository/arm_description', 'repository/resources_of_arm'),
    'in another repository': ('src/arm/arm_description', 'src/resources/arm_resources'),
    'ROS_PACKAGE_PATH': ('a/b/c/arm', 'elsewhere/packages/arm_resources'),
    'AMENT_PREFIX_PATH': ('a/b/c/arm', 'elsewhere/install/share/arm_resources'),
    'enclosing, without package.xml': ('arm_resources/x/y/arm', 'arm_resources'),
}


@pytest.mark.parametrize('layout', LAYOUTS)
def test_packages_are_found_where_vendors_have_them(workspace, monkeypatch, layout):
    own, other = (workspace / part for part in LAYOUTS[layout])
    path = description(own)
    package(other, 'arm_resources', RESOURCES)
    if 'without' in layout:
        (other / 'package.xml').unlink()
    if layout.endswith('PATH'):
        root = other.parent if layout.startswith('ROS') else other.parents[1]
        monkeypatch.setenv(layout, os.pathsep.join(['/none', str(root)]))
    robot = load_robot(path)
    assert robot.joints == ('left_joint',)
    assert robot.rigid_parameters[0] == 2.5
    assert collision_model(robot).left_out == ()


def test_a_package_is_given_on_the_command_line_and_known_to_the_model(workspace):
    path = description(workspace / 'x' / 'arm')
    place = package(workspace / 'a' / 'b' / 'my files', 'other', RESOURCES)
    with pytest.raises(RobotError, match='--package arm_resources='):
        load_robot(path)
    asked = ('layout', '--robot', f'{path} prefix:=right_', '--out', workspace / 'layout')
    armid(*asked, '--package', f'arm_resources={place}')
    source = f"{path} prefix:=right_ 'package:arm_resources:={place}'"
    robot = load_robot(source)
    assert robot.joints == ('right_joint',)
    assert collision_model(robot).left_out == ()
    save_model(workspace / 'model.yaml', ArmModel(robot), source)
    assert load_model(workspace / 'model.yaml').robot.joints == ('right_joint',)


@pytest.mark.parametrize(
    'text', ['arm_resources', '=here', 'arm_resources=', 'arm_resources=/not/there']
)
def test_a_package_that_is_none_is_refused(workspace, text):
    path = description(workspace / 'arm')
    asked = ('layout', '--robot', path, '--package', text, '--out', workspace / 'out')
    assert 'package' in armid(*asked, code=2).output


def test_an_unknown_macro_is_named_where_no_package_is_missing(workspace):
    path = workspace / 'arm.xacro'
    path.write_text(f'{XACRO}<xacro:arm_ros2_control/></robot>')
    with pytest.raises(RobotError, match='xacro:arm_ros2_control'):
        load_robot(path)


def test_a_missing_argument_is_named_with_those_that_there_are(workspace):
    path = description(workspace / 'arm')
    package(workspace / 'arm_resources', 'arm_resources', RESOURCES)
    macro = path.with_name('macro.xacro')
    macro.write_text(MACRO.replace('<link name="base"/>', '<link name="$(arg kind)"/>'))
    with pytest.raises(RobotError) as refused:
        load_robot(path)
    for part in ("'kind'", str(macro), f"{path} kind:=VALUE'", "grep '<xacro:arg'"):
        assert part in str(refused.value)
    with pytest.raises(RobotError, match=r"'prefx'.*did you mean 'prefix'"):
        load_robot(f'{path} kind:=base prefx:=b')


def test_processor_time_is_limited(workspace, monkeypatch):
    path = workspace / 'slow.xacro'
    path.write_text(
        f'{XACRO}<xacro:macro name="f" params="n"><xacro:if value="${{n}}">'
        '<xacro:f n="${n - 1}"/><xacro:f n="${n - 1}"/></xacro:if></xacro:macro>'
        '<xacro:f n="40"/></robot>'
    )
    monkeypatch.setattr(xacro_expansion, 'TIME_LIMIT', 0.5)
    with pytest.raises(RobotError, match=r'0\.5 s'):
        load_robot(path)
