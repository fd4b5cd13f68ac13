# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Efforts that are numerically nothing are what zeros are."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import grade, identify
from armid_ros.identification.rows.checks import SILENT
import numpy as np
import pytest

from ..conftest import multisine, recorded

TINY = [0.0, 1e-309, 1e-12]


@pytest.fixture(scope='module')
def run(arm):
    motion = multisine(arm.robot.joints, 20.0, 50.0, seed=1, base_hz=0.12)
    return recorded(arm, motion, 1, torque_noise=0.02, source='run')


@pytest.mark.parametrize('size', TINY)
@pytest.mark.filterwarnings('error')
def test_of_all_joints_they_are_refused(structure, run, size):
    with pytest.raises(IdentificationError, match=SILENT):
        identify(structure, [replace(run, tau=size * run.tau)], rng=np.random.default_rng(0))


@pytest.mark.parametrize('size', TINY)
@pytest.mark.filterwarnings('error')
def test_of_one_joint_its_channel_is_dead(structure, run, size):
    dead = replace(run, tau=np.where(np.arange(6) == 2, size * run.tau, run.tau))
    result = identify(structure, [dead], rng=np.random.default_rng(0))
    found = grade(result, structure, [dead], {})
    assert found.word == 'unusable'
    assert any(f'torque of {run.joints[2]} stays at' in reason for reason in found.reasons)
