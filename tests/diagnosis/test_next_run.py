# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A motion that separates two names, ready to run."""

from armid_ros.diagnosis import diagnose, next_run
from armid_ros.excitation import check_limits, Limits
import numpy as np


def test_the_next_run_is_within_the_limits_and_worth_something(bench):
    recordings = bench.recordings()
    robot = bench.robot
    heavier = robot.rigid_parameters.copy()
    heavier[10:14] += np.array([0.5, 0.0, 0.0, 0.1])  # 0.5 kg at 0.2 m of the lower link
    heavier[14:] += [0.02, 0.0, 0.02, 0.0, 0.0, 0.0]
    lighter = bench.arm.with_theta(
        np.concatenate([2 * robot.rigid_parameters - heavier, [0.3, 0.2], [0.5, 0.3]])
    )
    found = diagnose(lighter, recordings, rng=np.random.default_rng(0))
    chosen = next_run(found, np.random.default_rng(1))
    if found.verdict == 'named':
        assert chosen is None
        return
    assert found.verdict == 'ambiguous'
    assert chosen.worth >= 0.0
    motion = chosen.excitation.motion(100.0)
    assert not check_limits(Limits.of(robot, speed=1.0), motion)
