# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The unit of a wrist that is all friction shows in the limit of its drive, or beside a model."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import grade, identify
from armid_ros.identification.assess.data_faults import unit_faults
from armid_ros.identification.assess.sensor_faults import units_beyond_drives
from armid_ros.identification.rows.signals import conditioning, segments, SignalSettings
from armid_ros.robots import load_robot
import numpy as np
import pytest

from ..conftest import multisine, recorded

WRIST = 5
LIMIT = 10.0


@pytest.fixture(scope='module')
def arm():
    robot = load_robot('humanoid_arm')
    robot = replace(robot, torque_limit=np.where(np.arange(6) == WRIST, LIMIT, 1e3))
    body = robot.rigid_parameters.reshape(-1, 10).copy()
    body[WRIST] = 0.0
    light = ArmModel(robot.with_inertias(body.ravel()))
    return light.with_effect(make_effect('coulomb_friction', robot), np.full(6, 0.6))


@pytest.fixture(scope='module')
def run(arm):
    return recorded(arm, multisine(arm.robot.joints, 10.0, 100.0, seed=3), torque_noise=0.01)


def times(recording, factor, joints=(WRIST,)):
    tau = recording.tau.copy()
    tau[:, list(joints)] *= factor
    return replace(recording, tau=tau)


def filtered(recording):
    return list(segments(recording, conditioning([recording], SignalSettings())))


def beyond_drives(robot, recording):
    return list(units_beyond_drives(robot, [recording], filtered(recording)))


def test_half_of_the_readings_at_sixty_times_a_limit_are_in_another_unit(arm, run):
    (said,) = beyond_drives(arm.robot, times(run, 1e3))
    assert arm.robot.joints[WRIST] in said and 'another unit' in said


def test_torques_in_newton_metres_and_a_few_wrong_samples_are_no_unit(arm, run):
    assert beyond_drives(arm.robot, run) == []
    spoilt = run.tau.copy()
    spoilt[::50, WRIST] = 1e4
    assert beyond_drives(arm.robot, replace(run, tau=spoilt)) == []


def test_currents_are_in_no_one_unit(arm, run):
    gains = np.array([0.083, 0.025, 0.09, 0.125, 0.3, 0.5])
    currents = replace(run, tau=run.tau / gains)
    (said,) = unit_faults(arm, filtered(currents), filtered(run))
    assert 'currents?' in said
    assert said.endswith('--current-gain 0.083,0.025,0.09,0.125,0.3,0.5')
    assert unit_faults(arm, filtered(run), filtered(run)) == []
    (said,) = unit_faults(arm, filtered(replace(run, tau=1e3 * run.tau)), filtered(run))
    assert 'N mm' in said


@pytest.mark.parametrize(('factor', 'unit'), [(1e3, 'N mm'), (1e2, 'N cm'), (1e-3, 'kN m')])
def test_a_model_with_the_friction_tells_the_unit(arm, run, factor, unit):
    (said,) = unit_faults(arm, filtered(times(run, factor)))
    assert arm.robot.joints[WRIST] in said and f'in {unit} ' in said


@pytest.mark.parametrize('factor', [1.0, 3.0, 20.0])
def test_other_factors_and_all_joints_alike_are_no_unit_of_a_joint(arm, run, factor):
    assert unit_faults(arm, filtered(times(run, factor))) == []
    assert unit_faults(arm, filtered(times(run, 1e3 * factor, range(6)))) == []


def test_a_factor_that_was_there_before_is_that_of_the_model(arm, run):
    wrong = filtered(times(run, 1e3))
    assert unit_faults(arm, wrong, wrong) == []
    assert len(unit_faults(arm, wrong, filtered(run))) == 1


def test_the_grade_of_a_fit_of_such_a_torque_is_poor(arm, run):
    wrong = times(run, 1e3)
    fitted = identify(arm, [wrong], rng=np.random.default_rng(0))
    found = grade(fitted, arm, [wrong], {})
    assert found.word == 'poor'
    assert arm.robot.joints[WRIST] in found.reasons[0]
