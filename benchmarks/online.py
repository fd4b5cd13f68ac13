# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Online identification: time of an update, and its estimate next to the offline one.

The Panda of example-robot-data, 7 joints, all base parameters with viscous and Coulomb friction
and torque offset. The first table is of samples at 1 kHz, in process and without ROS: an update
that uses a row of the regressor, and all of them, with the default rate of rows and with a row
for every sample. The second one gives the recursive estimator the rows of the offline
identification. The third says what the filters do to an estimate from samples without noise.

    python -m benchmarks.online [--seconds 30]

"""

from __future__ import annotations

import argparse
import platform
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification.fitting.least_squares import solve
from armid_ros.identification.online.change_watch import ChangeSettings
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.identification.online.recursive import RecursiveLeastSquares
from armid_ros.identification.rows.causal import MOTION_FILTER_RATIO
from armid_ros.identification.rows.regression import regressions
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
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
    """Return five harmonics of 0.1 Hz per joint, up to 2 rad/s and 4 rad/s^2."""
    t = np.arange(0.0, seconds, 1.0 / RATE)
    w = 2.0 * np.pi * 0.1 * np.arange(1.0, 6.0)[:, None, None]
    size = 0.5 * rng.normal(size=(5, 1, robot.n_joints))
    angle = w * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, (5, 1, robot.n_joints))
    shares = (size / w * np.sin(angle), size * np.cos(angle), -size * w * np.sin(angle))
    q, dq, ddq = (share.sum(axis=0) for share in shares)
    return Motion(robot.joints, t, q + robot.middle_pose, dq, ddq)


def update_times(arm: ArmModel, motion: Motion, tau: FloatArray, settings: OnlineSettings) -> str:
    """Feed all samples; return one line of the table."""
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
    """Time the default and a row for every sample, without and with forgetting."""
    print('\nmicroseconds of processor time per sample at 1 kHz')
    print(f'{"":31s}with a row                         all samples')
    columns = 2 * ('p50', 'p99', 'p99.9', 'mean') + ('rows', 'par.')
    print(' ' * 20 + ''.join(f'{name:>9s}' for name in columns))
    cases = (
        (None, 'default', 1.0, ChangeSettings()),
        (None, 'no search', 1.0, None),
        (None, 'default', 0.999, ChangeSettings()),
        (RATE, 'every sample', 1.0, ChangeSettings()),
    )
    for rate, title, forgetting, changes in cases:
        settings = OnlineSettings(
            cutoff=CUTOFF, row_rate=rate, forgetting=forgetting, changes=changes
        )
        name = f'{title}, {forgetting:g}'
        print(f'{name:20s}  {update_times(arm, motion, tau, settings)}', flush=True)


def print_recursive_against_batch(arm: ArmModel, motion: Motion, tau: FloatArray) -> None:
    """Fit the rows of the offline identification by both."""
    recording = Recording(joints=motion.joints, t=motion.t, q=motion.q, tau=tau, source='bag')
    base = arm.base_parameters(np.random.default_rng(0))
    used = conditioning([recording], SignalSettings())
    (problem,) = regressions(arm, base.independent, [recording], used)
    print('\nrecursive against batch, same rows, no forgetting')
    print('method  rows   par.  largest relative difference of values')
    for method in ('ols', 'wls'):
        batch = solve([problem], method)
        noise = np.ones(7) if method == 'ols' else batch.joint_std
        recursive = RecursiveLeastSquares(base.parameters, noise)
        for rows, torque, use in zip(
            problem.columns, problem.tau, problem.informative, strict=True
        ):
            recursive.update(rows, torque, use)
        difference = np.max(np.abs(recursive.values / batch.values - 1.0))
        print(
            f'{method:6s}  {recursive.samples:5d}  {base.rank:3d}  {difference:.1e} '
            f'(wanted: 6 digits, {"reached" if difference < 1e-6 else "NOT reached"})'
        )


def print_bias_of_filtering(arm: ArmModel, motion: Motion) -> None:
    """Identify from exact samples; what is wrong afterwards is the filters' doing."""
    print('\nerror of predicted torque after identification from exact samples, % of torque')
    print('arm          low-pass behind and before the regressor   all of it before')
    for name, which in (('rigid', ArmModel(arm.robot)), ('friction', arm)):
        tau = which.torque(motion)
        errors = []
        for cutoff in (CUTOFF, CUTOFF / MOTION_FILTER_RATIO):  # the second one: G becomes F
            settings = OnlineSettings(cutoff=cutoff, row_rate=40.0 * CUTOFF)
            online = OnlineIdentifier(which, settings, rng=np.random.default_rng(0))
            for t, q, torque in zip(motion.t, motion.q, tau, strict=True):
                online.update(float(t), q, None, torque)
            columns = which.columns(motion.select(slice(0, None, 50)))
            columns = columns[:, :, online.base.independent]
            truth = columns @ online.base.values(which.theta)
            error = columns @ online.estimate().values - truth
            errors.append(100.0 * np.linalg.norm(error) / np.linalg.norm(truth))
        print(f'{name:12s} {errors[0]:20.4f} {errors[1]:38.4f}')


def main() -> None:
    """Print the three tables."""
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
    print_recursive_against_batch(arm, measured, tau)
    print_bias_of_filtering(arm, exact)


if __name__ == '__main__':
    main()
