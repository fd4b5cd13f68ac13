# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An offset is asked about among all causes: what has a mean looks like one."""

from dataclasses import replace

from armid_ros.diagnosis import diagnose
from armid_ros.recording import Recording
import numpy as np
import pytest

from tests.diagnosis.conftest import POSITION_NOISE, TORQUE_NOISE

LEAN = np.array([0.0, 1.2, 0.0])


def holding(arm, size, hidden, seed):
    """Return recordings of an arm that holds itself up, and moves by a share of its usual way."""
    rng = np.random.default_rng(seed)
    result = []
    for k, speed in enumerate((0.5, 1.0, 2.0)):
        motion = arm.motion(size * speed, 5.0, seed + k)
        motion = replace(motion, q=motion.q + LEAN)
        tau = arm.torque(motion)
        result.append(
            Recording(
                joints=motion.joints,
                t=motion.t,
                q=motion.q + POSITION_NOISE * rng.normal(size=motion.q.shape),
                tau=tau + hidden(tau) + TORQUE_NOISE * rng.normal(size=tau.shape),
                source=f'speed {speed:g}',
            )
        )
    return result


def gain(tau):
    """Return what a sensor of the shoulder reads too much of its torque."""
    return tau * [0.0, 0.03, 0.0]


def offset(tau):
    """Return what a sensor of the shoulder reads too much whatever its torque."""
    return np.broadcast_to([0.0, 0.3, 0.0], tau.shape)


@pytest.mark.long
@pytest.mark.parametrize('friction', ['known', 'named'])
@pytest.mark.parametrize(
    ('size', 'hidden', 'first'),
    [
        (0.6, gain, 'torque_gain'),
        (0.6, offset, 'torque_offset'),
        (0.1, gain, 'torque_gain'),
    ],
)
def test_a_gain_of_a_joint_that_holds_much_is_no_offset(upright, friction, size, hidden, first):
    """Also where the weight hardly changes."""
    arm = upright.arm if friction == 'known' else upright.named_friction()
    data, new = (holding(upright, size, hidden, seed) for seed in (0, 50))
    found = diagnose(arm, data, validate=new, rng=np.random.default_rng(0))
    (one,) = found.findings
    assert (one.name, one.joints) == (first, ('shoulder',)), found.summary
    rivals = {rival.name for rival in one.rivals}
    assert not rivals & {'torque_gain', 'torque_offset'}
