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

from benchmarks.real_recordings import emps, tx40, ur10

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


def test_friction_of_a_positioning_system_in_the_order_of_the_gap(real_data, tmp_path):
    found = look(emps(real_data, tmp_path))
    assert names(found)[:2] == ['viscous_friction', 'coulomb_friction']
    assert 'asymmetric_friction' in names(found)
    assert set(names(found)) <= {
        'viscous_friction',
        'coulomb_friction',
        'torque_offset',
        'asymmetric_friction',
    }
    left = sum(
        float(np.sum(((o.measured - o.after) * o.trajectory.told) ** 2))
        for o in found.gap.overlays
    )
    whole = sum(float(np.sum((o.measured * o.trajectory.told) ** 2)) for o in found.gap.overlays)
    assert np.sqrt(left / whole) < 0.032


def test_the_coupled_wrist_of_a_tx40(real_data, tmp_path):
    known = ('viscous_friction', 'coulomb_friction', 'torque_offset', 'rotor_inertia')
    found = look(tx40(real_data, tmp_path), known)
    wrist = next(f for f in found.findings if f.name == 'coupled_joint_friction')
    assert {'joint_5', 'joint_6'} <= set(wrist.joints)


def test_friction_of_a_ur10(real_data):
    found = look(ur10(real_data))
    assert {'viscous_friction', 'coulomb_friction'} <= set(names(found))
