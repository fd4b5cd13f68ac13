# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Processor time and memory of the jobs over samples, joints, bags and effects, with slopes.

``python -m benchmarks.growth`` writes results/growth.json, which the docs plot. Each
point is measured in a separate process. The arms are chains with friction on sums of sines.

"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
import json
from pathlib import Path
import resource
import subprocess
import sys
import tempfile
import time

import armid_ros as ar
from armid_ros.recording import write_recording
import numpy as np

from benchmarks.metrics import processor
from benchmarks.offline_speed import motion, RATE

OUT = Path(__file__).parent / 'results' / 'growth.json'
FRICTION = ('viscous_friction:viscous_coefficient=0.5', 'coulomb_friction:coulomb_torque=0.3')
OFFSET = 'torque_offset:torque_offset=1'
#: Job, varied quantity, and its values; the others are 7 joints, one bag of 12 s, two effects.
POINTS = {
    ('read', 'samples'): (10**4, 10**5, 10**6, 3 * 10**6),
    ('identify', 'samples'): (10**4, 10**5, 10**6),
    ('diagnose', 'samples'): (10**4, 3 * 10**4, 10**5, 3 * 10**5),
    ('identify', 'joints'): (1, 3, 7, 15, 30),
    ('diagnose', 'joints'): (1, 3, 7, 12),
    ('simulate', 'joints'): (1, 3, 7, 15, 30),
    ('online', 'joints'): (1, 3, 7, 15, 30),
    ('identify', 'bags'): (1, 10, 100, 300),
    ('identify', 'effects'): (1, 2, 4, 8),
}
DEFAULTS = {'samples': 12_000, 'joints': 7, 'bags': 1, 'effects': 2}
#: Number of samples of each of many bags.
BAG = 2_000
#: Effects in the order in which they are added.
EFFECTS = (
    'viscous_friction', 'coulomb_friction', 'torque_offset', 'rotor_inertia', 'quadratic_friction',
    'asymmetric_friction', 'joint_spring', 'load_dependent_friction',
)  # fmt: skip


def chain(joints: int) -> str:
    """Return the URDF of a serial chain of links whose joint axes alternate."""
    parts = ['<robot name="chain"><link name="l0"/>']
    for k in range(1, joints + 1):
        axis = ('0 0 1', '0 1 0', '1 0 0')[k % 3]
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="0.02 0.01 0.1"/><mass value="{2.0 / k}"/>'
            '<inertia ixx="0.01" iyy="0.012" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial>'
            f'</link><joint name="j{k}" type="revolute"><parent link="l{k - 1}"/>'
            f'<child link="l{k}"/><origin xyz="0 0 0.2"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" velocity="9" effort="9000"/></joint>'
        )
    return ''.join(parts) + '</robot>'


def recording(arm: ar.ArmModel, samples: int, seed: int) -> ar.Recording:
    """Return a noisy recording of a motion with three sines per joint."""
    made = motion(arm, samples / (60.0 * RATE), np.random.default_rng(seed))
    q, dq, tau = made.q, made.dq, made.tau
    return ar.Recording(joints=made.joints, t=made.t, q=q, dq=dq, tau=tau, source=f'bag{seed}')


def prepared(job: str, sizes: dict[str, int], folder: Path) -> Callable[[], object]:
    """Create the data of a timed job, and return the job as a function without arguments."""
    truth = ar.ArmModel.of(chain(sizes['joints']), effects=list(FRICTION))
    arm = ar.ArmModel.of(truth.robot, effects=EFFECTS[: sizes['effects']])
    size = sizes['samples'] if sizes['bags'] == 1 else BAG
    runs = [recording(truth, size, seed) for seed in range(sizes['bags'])]
    if job == 'read':
        write_recording(folder / 'bag', runs[0])
        return partial(ar.read_recording, folder / 'bag', truth.robot)
    if job == 'diagnose':
        changed = ar.ArmModel.of(truth.robot, effects=[*FRICTION, OFFSET])
        return partial(ar.diagnose, truth, recording(changed, size, 7), baseline=runs)
    if job == 'simulate':
        return partial(ar.simulate, truth, runs[0].motion())
    if job == 'online':
        online = ar.OnlineIdentifier(arm, rng=np.random.default_rng(0))
        samples = list(zip(runs[0].t, runs[0].q, runs[0].tau, strict=True))
        return lambda: [online.update(t, q, None, tau) for t, q, tau in samples]
    return partial(ar.identify, arm, runs)


def measure(run: Callable[[], object]) -> tuple[float, float]:
    """Return processor time [s] and additional memory [MB] of a call."""
    before, begun = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    run()
    used = time.process_time() - begun
    return used, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0


def slope(x: tuple[int, ...], y: list[float]) -> float:
    """Return the exponent of a power law that is fitted to the larger half of the sizes."""
    last = max(2, len(x) // 2)
    return float(np.polyfit(np.log(x[-last:]), np.log(np.maximum(y[-last:], 1e-3)), 1)[0])


def main() -> None:
    """Measure each job and size in a separate process; write and print the results."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument('--point', nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.point:
        job, axis, value = asked.point
        with tempfile.TemporaryDirectory() as folder:
            run = prepared(job, DEFAULTS | {axis: int(value)}, Path(folder))
            print(json.dumps(measure(run)))
        return
    table = []
    for (job, axis), values in POINTS.items():
        found = []
        for value in values:
            command = [sys.executable, '-m', 'benchmarks.growth', '--point', job, axis, str(value)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            found.append(json.loads(done.stdout.splitlines()[-1]))
        seconds, memory = (list(column) for column in zip(*found, strict=True))
        row = {'job': job, 'over': axis, 'values': values, 'seconds': seconds, 'megabytes': memory}
        table.append(row | {'slope': slope(values, seconds)})
        points = ', '.join(
            f'{v:,}: {s:.2f} s {m:.0f} MB' for v, (s, m) in zip(values, found, strict=True)
        )
        print(f'{job:9} over {axis:8} slope {table[-1]["slope"]:.2f}   {points}', flush=True)
    OUT.write_text(json.dumps({'machine': processor(), 'jobs': table}, indent=1) + '\n')


if __name__ == '__main__':
    main()
