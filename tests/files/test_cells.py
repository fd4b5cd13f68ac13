# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names of joints hold any character, in options and effects as in tables."""

from armid_ros.arm import ArmModel
from armid_ros.cli.diagnose import _tie
from armid_ros.cli.options import box
from armid_ros.effects import make_effect, parse_effect
from armid_ros.files.cells import listed, parted
from armid_ros.identification.known_payload import parse_payload
from armid_ros.nodes.running.launching import Argument
from armid_ros.robots import load_robot
import pytest

NAMES = ('a,b', 'c+d', 'e@f', 'g:h')


@pytest.fixture(scope='module')
def robot():
    """Return an arm whose joints have such names."""
    text = '<robot name="r"><link name="l"/>'
    for number, name in enumerate(NAMES):
        above = 'l' if number == 0 else f'l{number - 1}'
        text += (
            f'<link name="l{number}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" '
            f'ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="{name}" type="continuous">'
            f'<parent link="{above}"/><child link="l{number}"/></joint>'
        )
    return load_robot(text + '</robot>')


def test_a_list_has_names_with_its_separator_in_quotes():
    assert listed('x,"a,b",,c+d') == ('x', 'a,b', '', 'c+d')
    assert parted('E@"a,b"+c,F') == ['E@"a,b"+c', 'F']
    assert listed('"open, unclosed') == ('"open'.strip('"'), ' unclosed')


def test_effects_name_such_joints(robot):
    effect = make_effect('viscous_friction@"a,b"+"c+d"+e@f', robot)
    assert effect.joints == NAMES[:3]
    effect, values = parse_effect('coulomb_friction@"g:h"+e@f:coulomb_torque=0.2', robot)
    assert set(effect.joints) == {'g:h', 'e@f'}
    assert list(values) == [0.2, 0.2]
    arm = ArmModel.of(robot, effects='viscous_friction@"a,b",torque_offset')
    assert [one.joints for one in arm.effects] == [('a,b',), NAMES]


@pytest.mark.parametrize('joint', NAMES)
def test_options_take_such_names_in_quotes(robot, joint):
    quoted = f'"{joint}"'
    corners = ([-1.0, 0.0, 0.0], [1.0, 2.0, 3.0])
    assert box(f'{quoted}=-1,0,0:1,2,3', robot) == (joint, corners)
    bag, link, payload = parse_payload(f'a=b.mcap=2.6@{quoted}:0,0,0.1')
    assert (bag, link, payload.mass) == ('a=b.mcap', joint, 2.6)
    assert payload.lever.tolist() == [0.0, 0.0, 0.1]
    tie = _tie(f'{quoted}@0,0,1={quoted}', robot, robot)
    assert (tie.joint, tie.other_joint, tie.point) == (joint, joint, (0.0, 0.0, 1.0))
    assert Argument('joints', list, '').read(f'{quoted},x') == [joint, 'x']
