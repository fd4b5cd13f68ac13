# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rates of reported differences between two identifications of an arm: unchanged, loaded, worn.

Both are made from recordings of different motions with coloured torque noise and encoder noise,
and read from their identification.json.

"""

import argparse
import json
import time

from armid_ros.arm import ArmModel
from armid_ros.identification import (
    identification_document,
    IdentificationSettings,
    identify,
    SignalSettings,
)
from armid_ros.identification.assess.compare import compare
from armid_ros.identification.parameters_file import parameters_of
import numpy as np

from benchmarks.coverage import FRICTION, RATE, recorded
from benchmarks.multisine import multisine

ENCODER, TORQUE, POLE = 2e-5, 0.02, 0.95
LOAD = 0.1
WEAR = 1.5


def identified(arm, structure, duration, rng):
    """Identify an arm from a new recording; return the parameters in its document."""
    t = np.arange(round(duration * RATE)) / RATE
    motion = multisine(arm.robot.joints, t, rng)
    recording = recorded(motion, arm.torque(motion), rng, ENCODER, TORQUE, POLE)
    settings = IdentificationSettings(signals=SignalSettings(10.0, 4))
    result = identify(structure, [recording], settings, rng=np.random.default_rng(0))
    document = json.loads(json.dumps(identification_document(result, 'arm', {})))
    return parameters_of('repeat', document)


def arms():
    """Return the unchanged arm, the arm with a load, and the arm with more elbow friction."""
    arm = ArmModel.of('humanoid_arm', effects=FRICTION)
    robot = arm.robot
    body = np.array([1.0, 0.0, 0.0, 0.06, 0.005, 0.0, 0.005, 0.0, 0.0, 0.001])
    pi = robot.rigid_parameters.copy()
    pi[-10:] += LOAD * body
    loaded = arm.with_theta(np.concatenate([pi, *arm.values]))
    values = [v.copy() for v in arm.values]
    for law in values[:2]:
        law[3] *= WEAR
    return arm, loaded, ArmModel(robot, arm.effects, tuple(values))


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--pairs', type=int, default=200)
    parser.add_argument('--duration', type=float, default=20.0)
    arguments = parser.parse_args()
    arm, loaded, worn = arms()
    structure = ArmModel(arm.robot, arm.effects)
    rng = np.random.default_rng(0)
    start = time.process_time()
    alarms, alone, found, sizes, errors, wear = 0, 0, 0, [], [], 0
    for _ in range(arguments.pairs):
        first, second, third, fourth = (
            identified(other, structure, arguments.duration, rng)
            for other in (arm, arm, loaded, worn)
        )
        same = compare(first, second)
        alarms += same.anything
        alone += any(change.changed for change in same.changes)
        load = compare(first, third).load
        if load is not None and load.link == arm.robot.n_joints:
            found += 1
            sizes.append(load.mass)
            errors.append(abs(load.mass - LOAD) <= 1.96 * load.mass_std)
        rubbed = compare(first, fourth)
        joints = {c.parameter.joint for c in rubbed.changed}
        joints |= {g.joint for g in rubbed.groups if g.changed}
        wear += joints == {arm.robot.joints[3]}
    count = arguments.pairs
    print(f'{count} pairs of {arguments.duration:g} s ({time.process_time() - start:.0f} s)')
    print(f'    unchanged, said to differ  {100 * alarms / count:5.1f} %  wanted 5 % or less')
    print(f'      by a single parameter    {100 * alone / count:5.1f} %')
    print(
        f'    {1e3 * LOAD:g} g in the hand, found and placed  {100 * found / count:5.1f} %, '
        f'{1e3 * np.mean(sizes):.1f} ± {1e3 * np.std(sizes):.1f} g, 95 % intervals hold '
        f'{100 * np.mean(errors):.1f} %'
    )
    print(
        f'    {100 * (WEAR - 1):.0f} % more friction in the elbow, and nothing else, said  '
        f'{100 * wear / count:5.1f} %'
    )


if __name__ == '__main__':
    main()
