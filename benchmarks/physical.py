# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The torque error of physically consistent links, next to that of the unconstrained fit.

Simulated arms and recordings of real machines; the first two thirds of each are fitted, the last
one is predicted.

"""

from dataclasses import replace
import os
from pathlib import Path
import tempfile
import time

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.identification import (
    IdentificationSettings,
    identify,
    PhysicalSettings,
    Score,
)
from armid_ros.recording import read_recording, Recording
from armid_ros.robots import load_robot
import numpy as np

from benchmarks import real_recordings
from benchmarks.coverage import multisine
from tests.hidden.lived.arms import load_arm

#: Arms that are simulated: published descriptions, and drawn ones.
SIMULATED = ('humanoid', 'ur5', 'panda', 'z1', 'drawn-6-0', 'drawn-4-0')
FRICTION = ('viscous_friction', 'coulomb_friction', 'torque_offset')


def fits(arm, recording):
    """Identify without and with constraints; returns both results and their processor time."""
    results, seconds = [], []
    for physical in (None, PhysicalSettings()):
        settings = IdentificationSettings(physical=physical)
        start = time.process_time()
        results.append(identify(arm, [recording], settings, rng=np.random.default_rng(0)))
        seconds.append(time.process_time() - start)
    return results, seconds


def part(recording, samples):
    """Return some samples of a recording."""
    dq = None if recording.dq is None else recording.dq[samples]
    return replace(
        recording,
        t=recording.t[samples],
        q=recording.q[samples],
        dq=dq,
        tau=recording.tau[samples],
    )


def masses(robot, result):
    """Return the smallest and the largest mass of a link over the described one."""
    found, described = result.arm.robot.rigid_parameters[::10], robot.rigid_parameters[::10]
    ratio = found[described > 0.0] / described[described > 0.0]
    return ratio.min(), ratio.max()


def held_out(name, data, effects):
    """Print the error on the last third of a recording of a real machine."""
    robot = load_robot(str(data.robot))
    arm = ArmModel(robot)
    for effect in effects:
        arm = arm.with_effect(make_effect(effect, robot))
    compared(name, arm, read_recording(data.bags[0], joints=robot.joints))


def simulated(name):
    """Print the same of a simulated arm whose links are not as described, in masses by 20 %."""
    robot, rng = load_arm(name), np.random.default_rng(0)
    factors = np.repeat(rng.uniform(0.8, 1.2, robot.n_joints), 10)
    arm = ArmModel(robot)
    for effect in FRICTION:
        arm = arm.with_effect(make_effect(effect, robot))
    size = [0.1 * np.abs(robot.rigid_parameters[::10]).mean()] * robot.n_joints
    true = replace(arm, robot=robot.with_inertias(factors * robot.rigid_parameters))
    true = replace(true, values=tuple(np.array(size) for _ in arm.values))
    motion = multisine(robot.joints, 45.0, rng, 0.4)
    tau = true.torque(motion)
    noise = 0.02 * np.sqrt(np.mean(tau**2, axis=0))
    recording = Recording(
        joints=motion.joints,
        t=motion.t,
        q=motion.q + 1e-5 * rng.normal(size=motion.q.shape),
        tau=tau + noise * rng.normal(size=tau.shape),
        source=name,
    )
    compared(name, arm, recording, true.robot)


def compared(name, arm, recording, true=None):
    """Print the error on the last third of a recording, and the masses."""
    robot = arm.robot
    cut = 2 * len(recording.t) // 3
    results, seconds = fits(arm, part(recording, slice(None, cut)))
    rest = part(recording, slice(cut, None))
    free, bodies = (Score.of(r.predict([rest])).relative_error_percent for r in results)
    least = min(link.eigenvalues[0] for link in results[1].physical.links)
    print(
        f'{name:9s} held out {free:6.2f} %, among bodies {bodies:6.2f} % '
        f'({100 * (bodies / free - 1):+.1f} %, wanted +3 % or less), least eigenvalue '
        f'{least:.2g}, {seconds[1] - seconds[0]:+.1f} s'
    )
    low, high = masses(robot, results[1])
    held = ', '.join(results[1].physical.active) or 'none'
    if true is not None:
        print(
            '{:9s} masses over true ones from {:.2f} to {:.2f}'.format(
                '', *masses(true, results[1])
            )
        )
    print(
        f'{"":9s} masses over described ones from {low:.2f} to {high:.2f}; weight of the prior '
        f'{results[1].physical.weight:.0e}; at the limit of a body: {held}',
        flush=True,
    )


def main():
    """Print the table."""
    for name in SIMULATED:
        simulated(name)
    if not os.environ.get('ARMID_DATA'):
        print('ARMID_DATA names no recordings of real machines')
        return
    data = real_recordings.folder()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        held_out('EMPS', real_recordings.emps(data, out), FRICTION)
        held_out('UR10', real_recordings.ur10(data), FRICTION)
        coupled = (*FRICTION, 'rotor_inertia', 'coupled_joint_friction')
        held_out('TX40', real_recordings.tx40(data, out), coupled)


if __name__ == '__main__':
    main()
