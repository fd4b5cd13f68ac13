# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is too short, or filtered too low, is said to whom it is due."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import IdentificationSettings, identify, SignalSettings
from armid_ros.identification.rows.decimation import check_decimation
from armid_ros.identification.rows.signals import conditioning
import numpy as np
import pytest

from ..conftest import multisine, recorded


@pytest.fixture(scope='module')
def run(arm):
    """Return two seconds of motion."""
    return recorded(arm, multisine(arm.robot.joints, 2.0, 500.0, seed=1), torque_noise=0.01)


def test_a_recording_is_too_short_for_a_decimation_that_nobody_asked_for(run):
    used = replace(conditioning([run], SignalSettings(cutoff_hz=20.0)), decimation=40)
    with pytest.raises(IdentificationError) as refused:
        check_decimation([run], used, 60)
    said = str(refused.value)
    assert said.startswith('bag: 2.00 s are too short')
    assert 'record' in said and 's or more, or ask for --decimation' in said


def test_so_long_as_is_asked_for_is_enough(arm, run):
    used = replace(conditioning([run], SignalSettings(cutoff_hz=20.0)), decimation=40)
    with pytest.raises(IdentificationError) as refused:
        check_decimation([run], used, 60)
    duration = float(str(refused.value).split('record ')[1].split(' s')[0])
    check_decimation([recorded(arm, multisine(run.joints, duration, 500.0, seed=1))], used, 60)


def test_a_decimation_that_was_asked_for_is_too_large(run):
    used = conditioning([run], SignalSettings(20.0, decimation=40))
    with pytest.raises(IdentificationError, match='--decimation 40 leaves'):
        check_decimation([run], used, 60)


def test_a_cutoff_that_was_asked_for_is_too_low(structure, run):
    settings = IdentificationSettings(signals=SignalSettings(cutoff_hz=0.001))
    with pytest.raises(IdentificationError, match=r'bag: --cutoff 0.001 Hz is too low for 2.00 s'):
        identify(structure, [run], settings, rng=np.random.default_rng(0))
