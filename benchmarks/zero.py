# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Random arms in MuJoCo that play a plan: how well the fit finds what is hidden in them.

python -m benchmarks.zero [NUMBER [FIRST]]

"""

import sys

from armid_ros.excitation import CollisionScene
from armid_ros.zero.fit import fit_rests
from armid_ros.zero.plan import plan_zero
from armid_ros.zero.rests import find_rests
import numpy as np

from tests.hidden.machines import load_machine
from tests.zero.machine import play, Secret

ARMS = ('panda', 'ur10', 'xarm7')


def case(seed):
    """Return arm, intervals that hold the truth, all of them, and errors as shares."""
    name = ARMS[seed % len(ARMS)]
    robot, rng = load_machine(name), np.random.default_rng(seed)
    plan = plan_zero(robot, CollisionScene.of(robot, 0.01), seed=seed)
    secret = Secret.draw(robot, rng)
    rests = find_rests(play(robot, plan.trajectory, secret, rng))
    found, truth = fit_rests([rests], [robot]), secret.truth(robot)
    held = [
        abs(found.of(*key).value - value) <= found.of(*key).half_width
        for key, value in truth.items()
    ]
    gravity = [np.array([found.of(f'gravity_{a}').value for a in 'xyz']), secret.gravity(robot)]
    cosine = gravity[0] @ gravity[1] / np.prod(np.linalg.norm(gravity, axis=1))
    weight = np.abs(rests.tau - secret.zero).max(axis=0)
    zeros = [abs(found.of('zero', j).value - truth['zero', j]) for j in robot.joints]
    lacking = [f'{one.name} {one.joint}'.strip() for one in found.quantities if one.reason]
    return (
        name, len(rests), sum(held), len(held),
        float(np.degrees(np.arccos(min(cosine, 1.0)))),
        100.0 * abs(found.of('mass').value / secret.mass - 1.0),
        100.0 * float(np.max(zeros / weight)),
        ', '.join(lacking) or '-',
    )  # fmt: skip


if __name__ == '__main__':
    number, first = (*map(int, sys.argv[1:]), *(20, 100)[len(sys.argv) - 1 :])
    print('arm    rests  held    tilt [deg]  mass [%]  worst zero [%]  not determined')
    rows = [case(seed) for seed in range(first, first + number)]
    for name, count, held, of, tilt, mass, zero, lacking in rows:
        print(
            f'{name:6} {count:5}  {held:2}/{of}  {tilt:9.3f} {mass:9.2f} {zero:13.2f}    {lacking}'
        )
    held, of = (sum(row[k] for row in rows) for k in (2, 3))
    print(f'intervals hold the truth in {held} of {of}: {100.0 * held / of:.1f} %')
