# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Processor time and memory of the jobs over samples, joints, bags and effects, with slopes.

``python -m benchmarks.growth [--quick]`` writes results/growth.json, of which the docs draw a
picture. Each point is a process of its own. The arms are chains with friction on sums of sines.

"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import resource
import subprocess
import sys
import tempfile
import time

import armid_ros as ar
from armid_ros.effects import make_effect
from armid_ros.motion import Motion
from armid_ros.recording import write_recording
import numpy as np

OUT = Path(__file__).parent / 'results' / 'growth.json'
FRICTION = ('viscous_friction:viscous_coefficient=0.5', 'coulomb_friction:coulomb_torque=0.3')
OFFSET = 'torque_offset:torque_offset=1'
RATE = 200.0
#: Job, what grows, and its values; elsewhere 7 joints, one bag of 60 s, two effects.
POINTS = {
    ('read', 'samples'): (10**4, 10**5, 10**6, 3 * 10**6),
    ('identify', 'samples'): (10**4, 10**5, 10**6, 3 * 10**6),
    ('diagnose', 'samples'): (10**4, 3 * 10**4, 10**5, 3 * 10**5),
    ('identify', 'joints'): (1, 3, 7, 15, 30),
    ('diagnose', 'joints'): (1, 3, 7, 12),
    ('simulate', 'joints'): (1, 3, 7, 15, 30),
    ('online', 'joints'): (1, 3, 7, 15, 30),
    ('identify', 'bags'): (1, 10, 100, 1000),
    ('identify', 'effects'): (1, 2, 4, 8),
}
DEFAULTS = {'samples': 12_000, 'joints': 7, 'bags': 1, 'effects': 2}
#: Samples of one of many bags.
BAG = 2_000
#: Effects in the order in which they are added.
EFFECTS = (
    'viscous_friction', 'coulomb_friction', 'torque_offset', 'rotor_inertia', 'quadratic_friction',
    'asymmetric_friction', 'joint_spring', 'load_dependent_friction',
)  # fmt: skip
#: The largest values of a quick run.
QUICK = {'samples': 10**5, 'joints': 7, 'bags': 10, 'effects': 2}


def chain(joints: int) -> str:
    """Return the URDF of links one behind the other, whose axes take turns."""
    parts = ['<robot name="chain"><link name="l0"/>']
    for k in range(1, joints + 1):
        axis = ('0 0 1', '0 1 0', '1 0 0')[k % 3]
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="0.02 0.01 0.1"/><mass value="{2.0 / k}"/>'
            '<inertia ixx="0.01" iyy="0.012" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial>'
            f'</link><joint name="j{k}" type="revolute"><parent link="l{k - 1}"/>'
            f'<child link="l{k}"/><origin xyz="0 0 0.2"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" velocity="9" effort="90"/></joint>'
        )
    return ''.join(parts) + '</robot>'


def recording(arm: ar.ArmModel, samples: int, seed: int) -> ar.Recording:
    """Return exact torque with noise along three sines per joint."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / RATE
    q, dq, ddq = np.zeros((3, samples, arm.robot.n_joints))
    for hz, size in ((0.1, 0.5), (0.25, 0.3), (0.6, 0.1)):
        w = 2.0 * np.pi * hz
        angle = w * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, arm.robot.n_joints)
        q += size * np.sin(angle)
        dq += size * w * np.cos(angle)
        ddq -= size * w * w * np.sin(angle)
    motion = Motion(arm.robot.joints, t, q, dq, ddq)
    tau = arm.torque(motion) + 0.05 * rng.normal(size=q.shape)
    return ar.Recording(joints=arm.robot.joints, t=t, q=q, dq=dq, tau=tau, source=f'bag{seed}')


def measure(job: str, sizes: dict[str, int], folder: Path) -> tuple[float, float]:
    """Return processor time [s] and memory [MB] of a job, without making its data."""
    truth = ar.ArmModel.of(chain(sizes['joints']), effects=list(FRICTION))
    arm = ar.ArmModel(truth.robot)
    for name in EFFECTS[: sizes['effects']]:
        arm = arm.with_effect(make_effect(name, arm.robot))
    size = sizes['samples'] if sizes['bags'] == 1 else BAG
    runs = [recording(truth, size, seed) for seed in range(sizes['bags'])]
    changed = ar.ArmModel.of(truth.robot, effects=[*FRICTION, OFFSET])
    later, motion = recording(changed, size, 7), runs[0].motion()
    jobs = {
        'read': lambda: ar.read_recording(folder / 'bag', truth.robot),
        'identify': lambda: ar.identify(arm, runs),
        'diagnose': lambda: ar.diagnose(truth, later, baseline=runs),
        'simulate': lambda: ar.simulate(truth, motion),
        'online': lambda: learn(ar.OnlineIdentifier(arm, rng=np.random.default_rng(0)), runs[0]),
    }
    if job == 'read':
        write_recording(folder / 'bag', runs[0])
    before, begun = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    jobs[job]()
    used = time.process_time() - begun
    return used, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0


def learn(online: ar.OnlineIdentifier, run: ar.Recording) -> None:
    """Give an online identifier a recording, sample by sample."""
    for t, q, tau in zip(run.t, run.q, run.tau, strict=True):
        online.update(t, q, None, tau)


def slope(x: list[int], y: list[float]) -> float:
    """Return the exponent of the growth over the upper half of the values."""
    last = max(2, len(x) // 2)
    return float(np.polyfit(np.log(x[-last:]), np.log(np.maximum(y[-last:], 1e-3)), 1)[0])


def main() -> None:
    """Measure every point in a process of its own; write and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument(
        '--quick', action='store_true', help='small sizes only; nothing is written'
    )
    parser.add_argument('--point', nargs=3, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.point:
        job, axis, value = asked.point
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(measure(job, DEFAULTS | {axis: int(value)}, Path(folder))))
        return
    table = []
    for (job, axis), values in POINTS.items():
        kept = [value for value in values if not asked.quick or value <= QUICK[axis]]
        found = []
        for value in kept:
            command = [sys.executable, '-m', 'benchmarks.growth', '--point', job, axis, str(value)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            found.append(json.loads(done.stdout.splitlines()[-1]))
        seconds, memory = (list(column) for column in zip(*found, strict=True))
        row = {'job': job, 'over': axis, 'values': kept, 'seconds': seconds, 'megabytes': memory}
        table.append(row | {'slope': slope(kept, seconds)})
        points = ', '.join(
            f'{v:,}: {s:.2f} s {m:.0f} MB' for v, (s, m) in zip(kept, found, strict=True)
        )
        print(f'{job:9} over {axis:8} slope {table[-1]["slope"]:.2f}   {points}', flush=True)
    if not asked.quick:
        OUT.write_text(json.dumps({'machine': machine(), 'jobs': table}, indent=1) + '\n')


def machine() -> str:
    """Return the processor and the commit."""
    names = (
        line for line in Path('/proc/cpuinfo').read_text().splitlines() if 'model name' in line
    )
    commit = subprocess.run(
        ['git', 'rev-parse', '--short', 'HEAD'], capture_output=True, text=True
    )
    return f'{next(names, ": unknown").partition(": ")[2]}, commit {commit.stdout.strip()}'


if __name__ == '__main__':
    main()
