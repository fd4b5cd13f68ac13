# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification.assess.verification import forward_validation
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

from ..conftest import multisine, recorded

USED = Conditioning(rate_hz=500.0, cutoff_hz=30.0, decimation=5)


@pytest.fixture(scope='module')
def recording(arm):
    return recorded(arm, multisine(arm.robot.joints, 6.0, 500.0, seed=3))


def test_the_true_arm_follows_its_own_torques(arm, recording):
    score = forward_validation(arm, recording, USED, nominal=arm, duration=30.0)
    assert 1e3 * score.position_error.max() < 2.0
    assert score.torque_error.max() < 2e-3
    assert score.simulated.shape == score.motion.q.shape
    assert 'mrad' in score.worst


def test_missing_friction_moves_the_arm_by_its_torque_over_the_stiffness(arm, recording):
    """Nothing but 0.1 N m of friction more on the first joint."""
    values = list(arm.values)
    values[1] = values[1] + np.array([0.1, 0, 0, 0, 0, 0])
    other = ArmModel(arm.robot, arm.effects, tuple(values))
    scores = [
        forward_validation(a, recording, USED, nominal=arm, duration=30.0) for a in (arm, other)
    ]
    assert scores[1].position_error[0] > 5.0 * scores[0].position_error[0]
    assert 0.02 < scores[1].feedback_torque[0] < 0.2


def test_a_recording_too_short_is_refused(arm, recording):
    part = slice(0, 20)
    short = replace(recording, t=recording.t[part], q=recording.q[part], tau=recording.tau[part])
    with pytest.raises(IdentificationError, match='bag: no stretch'):
        forward_validation(arm, short, USED, nominal=arm, duration=30.0)
