# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Motions that determine four springs: the bound for 200 poses, and the result of 10 s at 1 kHz.

    python -m benchmarks.exo_motions

"""

from __future__ import annotations

from armid_ros.errors import IdentificationError
from armid_ros.identification.ties.problem import interaction_problem, MachineNoise
from armid_ros.model.spring_ties import SEGMENTS
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.leg_pair import exercise, EXERCISES, leg_pair
import numpy as np

from benchmarks.exo_noise import find_springs, TORQUE_NOISE, with_torques
from benchmarks.exo_poses import stiffness_bound

STIFFNESS, DEGREES = 1e4, 0.05
SECONDS = 10.0


def bound(name: str, samples: int = 200) -> FloatArray:
    """Return the smallest possible scatter of four stiffnesses from poses [per cent]."""
    pair = leg_pair(STIFFNESS)
    t = np.linspace(0.0, EXERCISES[name].period, samples + 1)[:-1]
    motions = with_torques(pair, exercise(pair, name, t))
    problem = interaction_problem(
        pair.machines,
        motions.own,
        motions.other,
        noise=MachineNoise(np.radians(DEGREES)),
        inertias='free',
        separate=True,
    )
    theta = np.concatenate([np.full(len(SEGMENTS), STIFFNESS), problem.described[len(SEGMENTS) :]])
    return 100.0 * stiffness_bound(problem, theta, TORQUE_NOISE) / STIFFNESS


def recorded(name: str, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Return error and stated deviation from 10 s at 1 kHz, inertias free [per cent]."""
    pair = leg_pair(STIFFNESS)
    motions = exercise(pair, name, np.arange(0.0, SECONDS, 1e-3))
    found = find_springs(
        pair, with_torques(pair, motions), DEGREES, seed, inertias='free', separate=True
    )
    scale = 100.0 / STIFFNESS
    return scale * (found.stiffness - STIFFNESS), scale * found.std


def main() -> None:
    """Print the table."""
    print('four springs, inertias free, 0.5 N m, 0.05 deg: deviation [%] of', ', '.join(SEGMENTS))
    for name, plan in EXERCISES.items():
        try:
            poses = bound(name)
            error, std = recorded(name)
        except IdentificationError as problem:
            print(f'{name:11s} {problem}')
            continue
        print(
            f'{name:11s} 200 poses, bound {_four(poses)}   10 s stated {_four(std)}   '
            f'error {_four(error)}   worst 95 % {1.96 * std.max():.1f}   {plan.what}',
            flush=True,
        )


def _four(values: FloatArray) -> str:
    return ' '.join(f'{value:6.2f}' for value in values)


if __name__ == '__main__':
    main()
