# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Online identification: processor time of an update.

The arm is the Panda of example-robot-data with 7 joints, all base parameters, viscous and Coulomb
friction and torque offset. Samples at 1 kHz are processed without ROS. Times are of updates with a
row of the regressor and of all updates, with the default rate of rows and a row per sample.

    python -m benchmarks.online [--seconds 30]

"""

from __future__ import annotations

import argparse
import platform
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.identification.online.settings import FALSE_ALARM_TIME
from armid_ros.motion import FloatArray, Motion
from armid_ros.robots import load_robot, Robot
import numpy as np

from benchmarks.real_recordings import example_robot

FRICTION = {'viscous_friction': 1.0, 'coulomb_friction': 0.5, 'torque_offset': 0.3}
RATE = 1000.0
CUTOFF = 5.0
TORQUE_NOISE = np.array([0.5, 0.5, 0.5, 0.5, 0.1, 0.1, 0.1])
POSITION_NOISE = 1e-5


def panda() -> ArmModel:
    """Return the arm with friction."""
    arm = ArmModel(load_robot(example_robot('panda_description/urdf/panda.urdf')))
    for name, value in FRICTION.items():
        arm = arm.with_effect(make_effect(name, arm.robot), np.full(7, value))
    return arm


def exciting_motion(robot: Robot, seconds: float, rng: np.random.Generator) -> Motion:
    """Return a motion of five harmonics of 0.1 Hz per joint, up to 2 rad/s and 4 rad/s^2."""
    t = np.arange(0.0, seconds, 1.0 / RATE)
    w = 2.0 * np.pi * 0.1 * np.arange(1.0, 6.0)[:, None, None]
    size = 0.5 * rng.normal(size=(5, 1, robot.n_joints))
    angle = w * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, (5, 1, robot.n_joints))
    shares = (size / w * np.sin(angle), size * np.cos(angle), -size * w * np.sin(angle))
    q, dq, ddq = (share.sum(axis=0) for share in shares)
    return Motion(robot.joints, t, q + robot.middle_pose, dq, ddq)


def update_times(arm: ArmModel, motion: Motion, tau: FloatArray, settings: OnlineSettings) -> str:
    """Identify online from all samples; return one line of the table of update times."""
    online = OnlineIdentifier(arm, settings, rng=np.random.default_rng(0))
    with_row, everything = [], []
    for t, q, torque in zip(motion.t, motion.q, tau, strict=True):
        start = time.thread_time()
        sample = online.update(float(t), q, None, torque)
        elapsed = time.thread_time() - start
        everything.append(elapsed)
        if sample is not None:
            with_row.append(elapsed)
    row = '  '.join(
        f'{1e6 * value:7.0f}'
        for times in (with_row, everything)
        for value in (*np.percentile(times, [50, 99, 99.9]), np.mean(times))
    )
    estimate = online.estimate()
    return f'{row}  {online.samples:7d}  {len(estimate.values):4d}'


def print_update_times(arm: ArmModel, motion: Motion, tau: FloatArray) -> None:
    """Print update times with default rows and with a row per sample, and with forgetting."""
    print('\nmicroseconds of processor time per sample at 1 kHz')
    print(f'{"":31s}with a row                         all samples')
    columns = 2 * ('p50', 'p99', 'p99.9', 'mean') + ('rows', 'par.')
    print(' ' * 20 + ''.join(f'{name:>9s}' for name in columns))
    cases = (
        (None, 'default', 1.0, FALSE_ALARM_TIME),
        (None, 'no search', 1.0, None),
        (None, 'default', 0.999, FALSE_ALARM_TIME),
        (RATE, 'every sample', 1.0, FALSE_ALARM_TIME),
    )
    for rate, title, forgetting, alarms in cases:
        settings = OnlineSettings(
            cutoff=CUTOFF, row_rate=rate, forgetting=forgetting, false_alarm_time=alarms
        )
        name = f'{title}, {forgetting:g}'
        print(f'{name:20s}  {update_times(arm, motion, tau, settings)}', flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=30.0, help='of motion at 1 kHz')
    seconds = parser.parse_args().seconds
    rng = np.random.default_rng(1)
    arm = panda()
    exact = exciting_motion(arm.robot, seconds, rng)
    tau = arm.torque(exact) + TORQUE_NOISE * rng.normal(size=exact.q.shape)
    noisy_q = exact.q + POSITION_NOISE * rng.normal(size=exact.q.shape)
    measured = Motion(exact.joints, exact.t, noisy_q, exact.dq, exact.ddq)
    print(f'{arm.robot.name}, {seconds:g} s at 1 kHz; Python {platform.python_version()}, one run')
    print_update_times(arm, measured, tau)


if __name__ == '__main__':
    main()
