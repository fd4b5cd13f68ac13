# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is named on recordings of real machines, and what is not invented."""

from armid_ros.arm import ArmModel
from armid_ros.diagnosis import diagnose
from armid_ros.effects import make_effect
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot
import numpy as np
import pytest

from benchmarks.real_diagnosis import answered, Machines, Question
from benchmarks.real_recordings import tx40, ur10

pytestmark = pytest.mark.real_data


def look(machine, effects=()):
    robot = load_robot(str(machine.robot))
    arm = ArmModel(robot)
    for name in effects:
        arm = arm.with_effect(make_effect(name, robot))
    recordings = [read_recording(bag, joints=robot.joints) for bag in machine.bags[:1]]
    return diagnose(arm, recordings, rng=np.random.default_rng(0))


def names(found):
    return [finding.name for finding in found.findings]


@pytest.mark.long
def test_the_coupled_wrist_of_a_tx40(real_data, tmp_path):
    known = ('viscous_friction', 'coulomb_friction', 'torque_offset', 'rotor_inertia')
    found = look(tx40(real_data, tmp_path), known)
    wrist = next(f for f in found.findings if f.name == 'coupled_joint_friction')
    assert {'joint_5', 'joint_6'} <= set(wrist.joints)


@pytest.mark.parametrize(
    'name', [pytest.param('viscous_friction', marks=pytest.mark.long), 'coulomb_friction']
)
def test_a_term_taken_out_of_the_model_of_a_positioning_system_is_named(real_data, tmp_path, name):
    machines = Machines(real_data, tmp_path)
    question = Question('emps', 'without', name)
    assert answered(question, machines.ask(question)) in ('first', 'named')


@pytest.mark.long
def test_friction_of_a_ur10(real_data):
    found = look(ur10(real_data))
    assert {'viscous_friction', 'coulomb_friction'} <= set(names(found))


@pytest.mark.long
@pytest.mark.parametrize(
    ('name', 'joint'), [('rotor_inertia', 'elbow_joint'), ('joint_spring', 'wrist_2_joint')]
)
def test_a_torque_added_to_that_of_a_ur10_is_named(real_data, tmp_path, name, joint):
    machines = Machines(real_data, tmp_path)
    question = Question('ur10', 'with', name, joint, 3.0)
    assert answered(question, machines.ask(question)) in ('first', 'named')


def test_friction_taken_out_of_the_model_of_a_ur10_is_named_in_all_joints(real_data, tmp_path):
    found = Machines(real_data, tmp_path).ask(Question('ur10', 'without', 'viscous_friction'))
    assert found.findings[0].name == 'viscous_friction'
    assert len(found.findings[0].joints) == 6


@pytest.mark.long
def test_a_ripple_of_a_ur10_is_named_and_no_link(real_data, tmp_path):
    """Nothing repeats in this recording: its noise is assumed, and excuses no wrong body."""
    machines = Machines(real_data, tmp_path)
    question = Question('ur10', 'with', 'torque_ripple', 'wrist_2_joint', 3.0)
    found = machines.ask(question)
    assert answered(question, found) in ('first', 'named')
    assert 'link_inertia' not in names(found)
