# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The human-exoskeleton leg pair: gait by torque in MuJoCo, stiffness from noisy angles.

Three tables: joints that follow their computed torque; the stiffness of one spring and of four;
and the motions that determine four springs.

    python -m benchmarks.exo [--draws 8]

"""

from __future__ import annotations

import argparse

from armid_ros.errors import IdentificationError
from armid_ros.identification.ties.problem import Inertias, interaction_problem
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.identification.ties.stiffness import identify_interaction, Interaction
from armid_ros.motion import Motion
from armid_ros.papers.exo.plant.gait_cycle import gait_cycle
from armid_ros.papers.exo.plant.leg_pair import (
    exercise,
    EXERCISES,
    leg_pair,
    PairMotion,
    stepping,
    TiedPair,
    with_noise,
    with_torques,
)
from armid_ros.papers.exo.plant.torque_driven import driving_torque
from armid_ros.papers.exo.plant.walkers import walking_pair
from armid_ros.recording import Recording
from armid_ros.robots.ties import SEGMENTS
import numpy as np

from tests.papers.exo.pair_in_mujoco import walk_in_mujoco

STIFFNESS = 1e4
#: Noise of the torques of the machine [N m].
TORQUE_NOISE = 0.5
PAIR = leg_pair(STIFFNESS)


def main() -> None:
    """Print the errors of torque-driven joints and of identified strap stiffness."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--draws', type=int, default=8, help='noise drawn so many times')
    asked = parser.parse_args()
    gait_by_torque()
    sets = {
        '200 poses': stepping(PAIR, np.linspace(0.0, 1.8, 201)[:-1]),
        '10 s 1 kHz': stepping(PAIR, np.arange(0.0, 10.0, 1e-3)),
    }
    exact = {name: with_torques(PAIR, motions) for name, motions in sets.items()}
    stiffness(exact, asked.draws)
    motions_of_four_springs()


def gait_by_torque() -> None:
    """Drive joints in MuJoCo by splined torques over a gait cycle, and print their errors."""
    cycle = gait_cycle(walking_pair())
    soft = cycle.pair.with_stiffness(0.8 * cycle.pair.stiffness)
    print('in MuJoCo, one joint by its torque               paper      wanted      measured')
    for joint, paper, wanted in (('exo_right_hip', 1.5, 0.05), ('exo_right_knee', 2.5, 0.1)):
        for rate, believed in ((100.0, None), (200.0, None), (1000.0, None), (200.0, soft)):
            tau = cycle.torques(believed)
            torque = driving_torque(cycle, joint, rate, tau)
            path = walk_in_mujoco(cycle, joint, torque).driven
            error = path - cycle.motions.own.q[:, cycle.pair.robot.index(joint)]
            most = float(np.degrees(np.abs(error).max()))
            what = f'{joint}, {rate:.0f} Hz' + (', springs 20 % too soft' if believed else '')
            aim = ' ' * 10 if believed else f'<= {wanted:4.2f} deg'
            print(f'  {what:45s} {paper:4.1f} deg {aim:11s}  {most:.3g} deg')


def stiffness(sets: dict[str, PairMotion], draws: int) -> None:
    """Identify strap stiffness from noisy data, and print mean error and scatter [%]."""
    print(
        f'stiffness, {TORQUE_NOISE} N m noise, inertias free: {draws} draws, the worst spring [%]'
    )
    print('  data       angles   springs  mean (scatter)  least squares  wanted')
    for degrees in (0.05, 0.1):
        for separate in (False, True):
            for data, exact in sets.items():
                found = [
                    find_springs(PAIR, exact, degrees, draw, inertias='free', separate=separate)
                    for draw in range(draws)
                ]
                errors = np.array([100.0 * (one.stiffness / STIFFNESS - 1.0) for one in found])
                plain = errors + np.array([100.0 * one.bias / STIFFNESS for one in found])
                mean, scatter = errors.mean(axis=0), errors.std(axis=0, ddof=1)
                worst = int(np.argmax(np.abs(mean) + scatter))
                print(
                    f'  {data:10s} {degrees:4.2f} deg  {"four" if separate else "one":5s}  '
                    f'{mean[worst]:+7.2f} ({scatter[worst]:.2f})  '
                    f'{plain.mean(axis=0)[worst]:+8.1f}       <= {5 if separate else 1}',
                    flush=True,
                )


def motions_of_four_springs() -> None:
    """Print 95 % intervals of the stiffness of four straps, from 10 s of each motion at 1 kHz."""
    print('four springs, inertias free, 0.05 deg, 10 s: 95 % interval [%] of', ', '.join(SEGMENTS))
    for name in EXERCISES:
        motions = with_torques(PAIR, exercise(PAIR, name, np.arange(0.0, 10.0, 1e-3)))
        try:
            found = find_springs(PAIR, motions, 0.05, 0, inertias='free', separate=True)
        except IdentificationError as problem:
            print(f'{name:11s} {problem}')
            continue
        shown = ' '.join(f'{196.0 * std / STIFFNESS:6.2f}' for std in found.std)
        print(f'{name:11s} {shown}', flush=True)


def find_springs(
    pair: TiedPair,
    motions: PairMotion,
    degrees: float,
    seed: int,
    *,
    inertias: Inertias = 'known',
    separate: bool = False,
) -> Interaction:
    """Add noise, and identify straps from poses, or from a recording if it has 1000 samples."""
    noise = np.radians(degrees), TORQUE_NOISE
    own, other = with_noise(motions, *noise, np.random.default_rng(seed))
    if len(own) < 1000:
        problem = interaction_problem(
            pair,
            own,
            other,
            noise=noise,
            inertias=inertias,
            separate=separate,
        )
        return identify_interaction(problem)
    return identify_interaction(
        recorded_interaction_problem(
            pair,
            recorded(own),
            recorded(other),
            inertias=inertias,
            separate=separate,
        )
    )


def recorded(motion: Motion, start_ns: int = 0) -> Recording:
    """Return a motion as a Recording."""
    return Recording(
        joints=motion.joints, t=motion.t, q=motion.q, tau=motion.tau, start_ns=start_ns
    )


if __name__ == '__main__':
    main()
