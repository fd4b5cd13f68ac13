# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Load data: units and frames by hand, and back to the payload of the model."""

from math import pi
import re

import armid_ros as ar
from armid_ros.cli.export.loads import abb, franka, kuka, load_of, load_text, universal_robots
from armid_ros.errors import ModelError
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

#: A flange 5 cm above the joint, turned by a quarter; a tool turned back from there by 30 degrees.
ROBOT = f"""<robot name="one"><link name="base"/><link name="arm"/><link name="wrist"/>
  <link name="flange"/><link name="tool"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="arm"/></joint>
  <joint name="roll" type="continuous"><parent link="arm"/><child link="wrist"/></joint>
  <joint name="f" type="fixed"><parent link="wrist"/><child link="flange"/>
    <origin xyz="0 0 0.05" rpy="0 0 {pi / 2}"/></joint>
  <joint name="t" type="fixed"><parent link="flange"/><child link="tool"/>
    <origin xyz="0 0 0.02" rpy="0 0 {-pi / 6}"/></joint></robot>"""
#: 2 kg at (0.04, 0, 0.1) m of the joint, with 0.01, 0.02 and 0.025 kg m^2 about its centre.
HAND = (2.0, 0.08, 0.0, 0.2, 0.03, 0.0, 0.0432, -0.008, 0.0, 0.0282)


def carrying(*loads):
    """Return the arm with payloads: joint and ten parameters."""
    arm = ar.ArmModel.of(ROBOT)
    for joint, ten in loads:
        arm = arm.with_effect(ar.make_effect(f'payload@{joint}', arm.robot), ten)
    return arm


def test_by_hand_in_the_frame_of_the_flange():
    load = load_of(carrying(('roll', HAND)))  # the flange by default
    call = 'set_target_payload(2.0, [0.0, -0.04, 0.05], [0.02, 0.01, 0.025, 0.0, 0.0, 0.0])'
    assert universal_robots(load) == call
    nine = '0.02, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.025'
    assert franka(load) == 'robot.setLoad(2.0, {{0.0, -0.04, 0.05}}, {{' + nine + '}});'
    place, moments = 'X 0.0,Y -40.0,Z 50.0,A 0.0,B 0.0,C 0.0', 'X 0.02,Y 0.01,Z 0.025'
    assert kuka(load) == 'LOAD_DATA[1]={M 2.0,CM {' + place + '},J {' + moments + '}}'
    parts = '2.0, [0.0, -40.0, 50.0], [1.0, 0.0, 0.0, 0.0], 0.02, 0.01, 0.025'
    assert abb(load) == f'PERS loaddata load1 := [{parts}];'
    # the axes of the tool, the last link, are 30 degrees behind those of the flange
    tool = load_of(carrying(('roll', HAND)), frame='tool')
    assert kuka(tool).endswith(',A 30.0,B 0.0,C 0.0},J {X 0.02,Y 0.01,Z 0.025}}')
    assert '[0.965925826, 0.0, 0.0, 0.258819045], 0.02, 0.01, 0.025]' in abb(tool)


def turned(rotation, moments):
    return rotation.as_matrix() @ np.diag(moments) @ rotation.as_matrix().T


#: How long a metre is, and the inertia of the other numbers.
READERS = {
    'ur': (1.0, lambda v: v[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3)),
    'franka': (1.0, lambda v: v.reshape(3, 3).T),
    'kuka': (1e3, lambda v: turned(Rotation.from_euler('ZYX', v[:3], degrees=True), v[3:])),
    'abb': (1e3, lambda v: turned(Rotation.from_quat([*v[1:4], v[0]]), v[4:])),
}


@pytest.mark.parametrize('frame', ['wrist', 'tool'])
@pytest.mark.parametrize('maker', READERS)
def test_what_a_maker_reads_is_the_payload_of_the_model(maker, frame):
    inertia = turned(Rotation.from_euler('xyz', [0.7, -0.4, 1.9]), [0.011, 0.017, 0.023])
    body = pin.Inertia(3.2, np.array([0.05, -0.07, 0.11]), inertia).toDynamicParameters()
    arm = carrying(('roll', body))
    text, _ = load_text(load_of(arm, frame=frame), maker, 'model.yaml')
    found = re.findall(r'(?<![\w.])-?\d+\.\d+', text.splitlines()[-1])
    mass, *others = map(float, found)
    metre, read = READERS[maker]
    load = pin.Inertia(mass, np.array(others[:3]) / metre, read(np.array(others[3:])))
    placement = arm.robot.model.frames[arm.robot.model.getFrameId(frame)].placement
    np.testing.assert_allclose(placement.act(load).toDynamicParameters(), body, atol=1e-8)


def test_an_inertia_that_no_body_has_is_a_point_mass_and_a_note():
    impossible = np.array(HAND) - 0.015 * (np.arange(10) == 4)
    text, notes = load_text(load_of(carrying(('roll', impossible))), 'ur', 'm')
    assert '[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]' in text
    assert any('no body' in note and note in text for note in notes)


def test_the_default_frame_has_the_usual_name_or_is_asked_for():
    arm = ar.ArmModel.of(ROBOT.replace('"flange"', '"link8"'))
    arm = arm.with_effect(ar.make_effect('payload@roll', arm.robot), HAND)
    with pytest.raises(ModelError, match=r'--frame; wrist, .*link8'):
        load_of(arm)


@pytest.mark.parametrize(
    ('loads', 'asked', 'answer'),
    [
        ((), {}, 'armid diagnose'),
        ((('roll', HAND),), {'frame': 'flnge'}, "did you mean 'flange'"),
        ((('roll', HAND),), {'frame': 'arm'}, 'wrist or flange or tool'),
        ((('roll', HAND),), {'joint': 'shoulder'}, '--joint: roll'),
        ((('roll', HAND), ('shoulder', HAND)), {}, '--joint: roll, shoulder'),
        ((('roll', (-0.5, *HAND[1:])),), {}, '-0.5 kg'),
        ((('shoulder', HAND),), {}, 'roll moves behind it'),
    ],
)
def test_a_load_that_cannot_be_written_is_an_error_with_the_answer(loads, asked, answer):
    with pytest.raises(ModelError, match=re.escape(answer)):
        load_of(carrying(*loads), **asked)
