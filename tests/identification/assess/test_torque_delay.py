# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A delay is told by what friction does not do, and only where it is more than its uncertainty."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects.slipping import Hysteresis
from armid_ros.identification.assess.mistakes import find_mistake, torque_delay
from armid_ros.identification.rows.signals import conditioning, SignalSettings
import numpy as np
import pytest

from ..conftest import multisine, recorded

RATE = 100.0


def giving_way(robot, length, seed, share=1.0):
    """Record an arm near its description whose friction gives way over a length [rad]."""
    rng = np.random.default_rng(seed)
    n = robot.n_joints
    links = robot.rigid_parameters.reshape(-1, 10) * rng.uniform(0.9, 1.1, (n, 1))
    arm = ArmModel(robot.with_inertias(links.ravel()))
    motion = multisine(robot.joints, 30.0, RATE, seed=seed, base_hz=0.12)
    exact = recorded(arm, motion, seed, position_noise=1e-5)
    size = np.sqrt(np.mean(exact.tau**2, axis=0))
    bent = Hysteresis(np.eye(n), np.ones(n), length * rng.uniform(0.6, 1.6, n))
    friction = share * size * (bent.along(motion.q, motion.dq) + 0.3 * motion.dq)
    noise = 0.01 * size * rng.normal(size=exact.tau.shape)
    return replace(exact, tau=exact.tau + friction + noise)


def delayed(recording, seconds):
    """Return a recording whose torques are read late."""
    tau = [np.interp(recording.t - seconds, recording.t, column) for column in recording.tau.T]
    return replace(recording, tau=np.column_stack(tau))


def told(robot, recording):
    """Return the delay that is told of a recording; none where it is told from no zero."""
    return torque_delay(robot, recording, conditioning([recording], SignalSettings()))


@pytest.mark.parametrize(('length', 'share'), [(1e-4, 2.0), (1e-3, 0.5), (3e-3, 2.0), (1e-2, 0.5)])
def test_friction_that_gives_way_is_no_delay(robot, length, share):
    """Friction of half and of twice the torque of the body, over a tenth to ten milliradians."""
    recording = giving_way(robot, length, 3, share)
    found = find_mistake(robot, recording, conditioning([recording], SignalSettings()))
    assert found is None
    late = told(robot, recording)
    assert late is None or abs(late.seconds) - late.half_width < 2e-3


@pytest.mark.parametrize(
    ('length', 'seconds'), [(1e-4, -0.05), (2e-3, 0.1), (1e-2, 0.02), (1e-2, 0.05)]
)
def test_a_delay_is_told_beside_friction_that_gives_way(robot, length, seconds):
    recording = delayed(giving_way(robot, length, 4), seconds)
    late = told(robot, recording)
    assert late is not None
    assert late.seconds == pytest.approx(seconds, abs=late.half_width + 1e-3)
    assert late.half_width < 0.01
    weightless = robot.with_inertias(0.0 * robot.rigid_parameters)
    assert told(weightless, recording) is None


def test_an_interval_holds_the_delay_of_most_recordings(robot):
    """Nineteen of twenty are expected to; of twenty, fewer than sixteen are one chance in 400."""
    held = 0
    for seed in range(20):
        late = told(robot, delayed(giving_way(robot, 2e-3, 100 + seed), 0.03))
        held += late is not None and abs(late.seconds - 0.03) <= late.half_width
    assert held >= 16
