# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings for tests of commands."""

from armid_ros.arm import ArmModel
from armid_ros.cli import main
from armid_ros.recording import write_recording
from click.testing import CliRunner
import numpy as np
import pytest

from benchmarks.multisine import multisine

ROBOT = 'humanoid_arm'
DURATION, RATE = 14, 100  # s, Hz


def armid(*arguments, code=0):
    """Run a command and check its exit code; return its result."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == code, result.output
    return result


def bag_of(path, arm, seed):
    """Write a noisy recording of a motion in closed form."""
    rng = np.random.default_rng(seed)
    t = np.arange(DURATION * RATE) / RATE
    motion = multisine(arm.robot.joints, t, rng, ((0.15, 0.5), (0.4, 0.25), (0.9, 0.08)))
    noise = 0.01 * rng.normal(size=motion.q.shape)
    measured = motion.with_torque(arm.torque(motion) + noise)
    write_recording(path, measured, robot_description=arm.robot.urdf)
    return path


@pytest.fixture(scope='session')
def bags(tmp_path_factory):
    """Return two recordings of the shipped arm with viscous friction."""
    folder = tmp_path_factory.mktemp('bags')
    arm = ArmModel.of(ROBOT, effects='viscous_friction:viscous_coefficient=0.1')
    return [bag_of(folder / name, arm, seed) for seed, name in enumerate(('train', 'held_out'))]
