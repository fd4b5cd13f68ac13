# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings of real machines: errors and parameters next to the published ones."""

from armid_ros.arm import ArmModel
from armid_ros.identification import IdentificationSettings, identify, Score, SignalSettings
from armid_ros.recording import read_recording
from armid_ros.robots import load_robot
import numpy as np
import pytest

from benchmarks import real_recordings

pytestmark = pytest.mark.real_data

FRICTION = ('viscous_friction', 'coulomb_friction', 'torque_offset')


def fit(robot, bag, effects, method='wls', **signals):
    arm = ArmModel.of(robot, effects=effects)
    settings = IdentificationSettings(method, SignalSettings(**signals))
    recording = read_recording(bag, joints=robot.joints)
    return identify(arm, [recording], settings, rng=np.random.default_rng(0))


def error(fits):
    return Score.of(fits).relative_error_percent


@pytest.fixture(scope='module')
def emps(real_data, tmp_path_factory):
    data = real_recordings.emps(real_data, tmp_path_factory.mktemp('emps'))
    return load_robot(str(data.robot)), data.bags


@pytest.fixture(scope='module')
def tx40(real_data, tmp_path_factory):
    data = real_recordings.tx40(real_data, tmp_path_factory.mktemp('tx40'))
    return load_robot(str(data.robot)), data.bags[0]


def test_emps_parameters_are_the_published_ones(emps):
    """Janot, Gautier and Brunot 2019: M 95.11 kg, Fv 203.5 N s/m, Fc 20.39 N, offset -3.16 N."""
    robot, (bag, pulses) = emps
    result = fit(robot, bag, FRICTION)
    published = [95.1089, 203.5034, 20.3935, -3.1648]
    np.testing.assert_allclose(result.estimate.values, published, rtol=5e-3)
    assert error(result.training) <= 4.10
    assert error(result.predict([read_recording(pulses, joints=robot.joints)])) <= 6.0


def test_emps_error_falls_with_every_effect(emps):
    """Mass 69.4 %, viscous 17.9 %, Coulomb 7.1 %, offset 4.04 %, asymmetry 3.06 %."""
    robot, (bag, _) = emps
    ladder = [(), FRICTION[:1], FRICTION[:2], FRICTION, (*FRICTION, 'asymmetric_friction')]
    errors = [error(fit(robot, bag, effects).training) for effects in ladder]
    np.testing.assert_allclose(errors, [69.4, 17.9, 7.1, 4.04, 3.06], rtol=0.06)


def test_tx40_needs_the_coupling_of_its_wrist(tx40):
    """Friction of joint 1 is the published weighted estimate, within its published deviation."""
    robot, bag = tx40
    effects = (*FRICTION, 'rotor_inertia')
    without = fit(robot, bag, effects, method='ols', decimation=100)
    coupled = fit(robot, bag, (*effects, 'coupled_joint_friction'), method='ols', decimation=100)
    assert error(coupled.training) <= 5.2
    assert Score.of(without.training).joint_relative_error_percent[4] > 40.0
    estimate = coupled.estimate
    published = {'viscous_coefficient': (8.087, 0.054), 'coulomb_torque': (7.014, 0.159)}
    for name, (value, std) in published.items():
        found = estimate.values[estimate.index(name, 'joint_1')]
        assert abs(found - value) < 2 * std
