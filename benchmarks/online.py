# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Online identification: processor time of an update.

The arm is the Panda of example-robot-data with 7 joints, all base parameters, viscous and Coulomb
friction and torque offset. Samples at 1 kHz are processed without ROS. Times are given for
updates with a regressor row and for all updates, at the default rate of rows and at one row per
sample.

    python -m benchmarks.online [--seconds 30]

"""

from __future__ import annotations

import argparse
from dataclasses import replace
import platform
import time

from armid_ros.arm import ArmModel
from armid_ros.identification.online.identifier import OnlineIdentifier, OnlineSettings
from armid_ros.motion import Motion
import numpy as np

from benchmarks.offline_speed import motion, panda

CUTOFF = 5.0
POSITION_NOISE = 1e-5


def update_times(arm: ArmModel, measured: Motion, settings: OnlineSettings) -> str:
    """Identify online from all samples, and return update times as a table line."""
    online = OnlineIdentifier(arm, settings, rng=np.random.default_rng(0))
    used, with_row = [], []
    assert measured.tau is not None
    for t, q, torque in zip(measured.t, measured.q, measured.tau, strict=True):
        start = time.thread_time()
        sample = online.update(float(t), q, None, torque)
        used.append(time.thread_time() - start)
        with_row.append(sample is not None)
    times = 1e6 * np.array(used)
    row = '  '.join(
        f'{value:7.0f}'
        for part in (times[with_row], times)
        for value in (*np.percentile(part, [50, 99, 99.9]), np.mean(part))
    )
    return f'{row}  {online.samples:7d}  {len(online.estimate().values):4d}'


def main() -> None:
    """Print update times with and without a search for changes, and with forgetting."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=float, default=30.0, help='of motion at 1 kHz')
    seconds = parser.parse_args().seconds
    rng, arm = np.random.default_rng(1), panda()
    made = motion(arm, seconds / 60.0, rng)
    measured = replace(made, q=made.q + POSITION_NOISE * rng.normal(size=made.q.shape))
    print(f'{arm.robot.name}, {seconds:g} s at 1 kHz; Python {platform.python_version()}, one run')
    print('\nmicroseconds of processor time per sample at 1 kHz')
    print(f'{"":31s}with a row                         all samples')
    columns = 2 * ('p50', 'p99', 'p99.9', 'mean') + ('rows', 'par.')
    print(' ' * 20 + ''.join(f'{name:>9s}' for name in columns))
    for title, options in (
        ('default, 1', {}),
        ('no search, 1', {'false_alarm_time': None}),
        ('default, 0.999', {'forgetting': 0.999}),
    ):
        settings = OnlineSettings(cutoff=CUTOFF, **options)
        print(f'{title:20s}  {update_times(arm, measured, settings)}', flush=True)


if __name__ == '__main__':
    main()
