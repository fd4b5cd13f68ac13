# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Velocities that are a factor from positions in every joint show a time that is not the arm's."""

from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.assess.sensor_faults import velocity_faults
from armid_ros.robots import load_robot
import numpy as np
import pytest
from scipy import signal

from ..conftest import multisine, recorded

RATE = 100.0


@pytest.fixture(scope='module')
def arm():
    robot = load_robot('humanoid_arm')
    return ArmModel(robot).with_effect(make_effect('viscous_friction', robot), np.full(6, 0.1))


@pytest.fixture(scope='module')
def run(arm):
    motion = multisine(arm.robot.joints, 20.0, RATE, seed=1, base_hz=0.12)
    made = recorded(arm, motion, torque_noise=0.01, position_noise=1e-4, source='run')
    noise = 0.05 * np.random.default_rng(2).normal(size=motion.dq.shape)
    return replace(made, dq=motion.dq + noise)


def time_faults(recording):
    return [fault.text for fault in velocity_faults(recording) if fault.word != 'good']


@pytest.mark.parametrize('factor', [0.5, 0.9, 1.1, 3.0])
def test_a_wrong_time_is_said(run, factor):
    (said,) = time_faults(replace(run, t=factor * run.t))
    number = re.search(r'(\S+) times', said).group(1)
    assert float(number) == pytest.approx(factor, rel=0.01)


def jittering(run):
    by = np.random.default_rng(3).uniform(-0.02, 0.02, len(run))
    return replace(run, t=np.sort(run.t + by))


@pytest.mark.parametrize(
    'change',
    [
        lambda run: replace(run, dq=signal.lfilter([0.06], [1.0, -0.94], run.dq, axis=0)),
        jittering,
        lambda run: run.select(np.r_[0:700, 1100:2000]),
        lambda run: replace(run, dq=run.dq * np.array([1.0, 1.0, 1.2, 1.0, 1.0, 1.0])),
        lambda run: replace(run, dq=np.rad2deg(run.dq)),
        lambda run: run.select(slice(None, None, 8)),
        lambda run: replace(run, dq=1.03 * run.dq),
        lambda run: replace(run, dq=None),
    ],
    ids=['late', 'jitter', 'gap', 'one joint', 'degrees', 'coarse', 'slightly off', 'without'],
)
def test_what_noise_filters_and_units_make_is_no_wrong_time(run, change):
    assert time_faults(change(run)) == []
