# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings for tests of commands."""

from armid_ros.arm import ArmModel
from armid_ros.cli import main
from armid_ros.motion import Motion
from armid_ros.recording import write_recording
from click.testing import CliRunner
import numpy as np
import pytest

ROBOT = 'humanoid_arm'
DURATION, RATE = 14, 100  # s, Hz


def armid(*arguments, code=0):
    """Run a command and check its exit code; return its result."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == code, result.output
    return result


def bag_of(path, arm, seed, moving=slice(None)):
    """Write a noisy recording of a motion in closed form, of all joints or of some."""
    rng = np.random.default_rng(seed)
    t = np.arange(DURATION * RATE) / RATE
    q, dq, ddq = np.zeros((3, len(t), 6))
    for hz, size in ((0.15, 0.5), (0.4, 0.25), (0.9, 0.08)):
        w = 2 * np.pi * hz
        angle = w * t[:, None] + rng.uniform(0, 2 * np.pi, 6)
        q += size * np.sin(angle)
        dq += size * w * np.cos(angle)
        ddq -= size * w * w * np.sin(angle)
    still = np.ones(6, dtype=bool)
    still[moving] = False
    q[:, still], dq[:, still], ddq[:, still] = 0.2, 0.0, 0.0
    motion = Motion(arm.robot.joints, t, q, dq, ddq)
    noise = 0.01 * rng.normal(size=q.shape)
    measured = motion.with_torque(arm.torque(motion) + noise)
    write_recording(path, measured, robot_description=arm.robot.urdf)
    return path


@pytest.fixture(scope='session')
def bags(tmp_path_factory):
    """Return two recordings of the shipped arm with viscous friction."""
    folder = tmp_path_factory.mktemp('bags')
    arm = ArmModel.of(ROBOT, effects='viscous_friction:viscous_coefficient=0.1')
    return [bag_of(folder / name, arm, seed) for seed, name in enumerate(('train', 'held_out'))]
