# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The human-exoskeleton leg pair: gait by torque in MuJoCo, stiffness from noisy angles.

The tables compare the claims of the source, the aims of this package, and measurements.

    python -m benchmarks.exo [--draws 8] [--repeats 400] [--sets 24] [--first-seed 0]

"""

from __future__ import annotations

import argparse

from armid_ros.identification.ties.problem import (
    Inertias,
    interaction_problem,
    InteractionProblem,
    MachineNoise,
)
from armid_ros.identification.ties.stiffness import Interaction
from armid_ros.motion import FloatArray, Motion
from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.papers.exo.plant.gait_cycle import driving_torque, gait_cycle
from armid_ros.papers.exo.plant.leg_pair import (
    leg_pair,
    pair_torques,
    PairMotion,
    stepping,
    TiedPair,
    walking,
)
from armid_ros.papers.exo.plant.torque_driven import splined
from armid_ros.papers.exo.plant.walkers import walking_pair
import numpy as np

from benchmarks.exo_deviations import deviations
from benchmarks.exo_diagnosis import diagnosed
from benchmarks.exo_noise import find_springs, TORQUE_NOISE, with_torques
from benchmarks.exo_poses import choose_poses, stiffness_bound
from benchmarks.leg_pair_in_mujoco import drive_in_mujoco
from benchmarks.walking_in_mujoco import walk_in_mujoco

SECONDS = 6.0
#: Duration of a step forward and back, for the steps from which poses are chosen [s].
SPEEDS = (1.8, 1.2, 0.9)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--draws', type=int, default=8, help='noise drawn so many times')
    parser.add_argument('--repeats', type=int, default=400, help='for stated deviations')
    parser.add_argument('--sets', type=int, default=24, help='recordings with hidden springs')
    parser.add_argument('--first-seed', type=int, default=0, help='of the hidden sets')
    asked = parser.parse_args()
    gait_by_torque()
    stiffness(asked.draws)
    deviations(asked.repeats)
    diagnosed(asked.sets, asked.first_seed)


def gait_by_torque() -> None:
    """Drive joints by splined torques in MuJoCo over a cycle, then all joints at once."""
    cycle = gait_cycle(walking_pair(), read_gait())
    soft = cycle.pair.with_stiffness(0.8 * cycle.pair.stiffness)
    print('in MuJoCo, one joint by its torque               paper      wanted      measured')
    for joint, paper, wanted in (('exo_right_hip', 1.5, 0.05), ('exo_right_knee', 2.5, 0.1)):
        for rate, believed in ((100.0, None), (200.0, None), (1000.0, None), (200.0, soft)):
            torque = driving_torque(cycle, joint, rate, believed)
            path = walk_in_mujoco(cycle, joint, lambda t, torque=torque: torque(t)[2]).driven
            error = _most(path - cycle.motions.own.q[:, cycle.pair.robot.index(joint)])
            what = f'{joint}, {rate:.0f} Hz' + (', springs 20 % too soft' if believed else '')
            aim = ' ' * 10 if believed else f'<= {wanted:4.2f} deg'
            print(f'  {what:45s} {paper:4.1f} deg {aim:11s}  {error:.3g} deg')
    pair = leg_pair()
    whole = walking(pair, read_gait(), np.linspace(0.0, 1.2, 1201))
    for rate, share in ((50.0, 1.0), (100.0, 1.0), (400.0, 1.0), (400.0, 1.01)):
        torque = splined(whole.own.t, share * pair_torques(pair, *whole).tau, rate)
        path = drive_in_mujoco(pair, whole, pair.robot.joints, torque)
        what = f'all joints, {rate:.0f} Hz' + (', torques 1 % off' if share != 1 else '')
        print(f'  {what:45s}     -                     {_most(path - whole.own.q):.2g} deg')


def _most(error: FloatArray) -> float:
    return float(np.degrees(np.abs(error).max()))


def stiffness(draws: int) -> None:
    """Identify the springs from 200 poses and from a recording, with noise; print a table."""
    pair, gait = leg_pair(1e4), read_gait()
    seconds = stepping(pair, gait, np.arange(0.0, 10.0, 1e-3))
    sets = {
        '200 poses': stepping(pair, gait, np.linspace(0.0, 1.8, 201)[:-1]),
        '200 chosen': chosen_poses(pair),
        '10 s 1 kHz': seconds,
    }
    print(
        f'stiffness, {TORQUE_NOISE} N m noise: mean error (scatter) of {draws} draws in per cent'
    )
    print(
        '  data       angles   inertias  springs       this          bound    '
        'least squares    wanted'
    )
    for degrees in (0.05, 0.1):
        for inertias in ('known', 'free'):
            for separate in (False, True):
                for data, motions in sets.items():
                    exact = with_torques(pair, motions)
                    found = [
                        find_springs(
                            pair, exact, degrees, draw, inertias=inertias, separate=separate
                        )
                        for draw in range(draws)
                    ]
                    least = None
                    if motions is not seconds:
                        least = _bound(pair, exact, degrees, inertias, separate)
                    line = f'  {data:10s} {degrees:4.2f} deg  {inertias:5s}  '
                    print(line + _judged(found, degrees, inertias, least), flush=True)


def chosen_poses(pair: TiedPair) -> PairMotion:
    """Choose the 200 poses of steps at three speeds that determine four springs best."""
    gait = read_gait()
    parts = [stepping(pair, gait, np.linspace(0.0, period, 601)[:-1], period) for period in SPEEDS]
    own, other = (_joined([part[side] for part in parts]) for side in (0, 1))
    exact = with_torques(pair, PairMotion(own, other))
    problem, theta = _planned(pair, exact, 0.05, 'free', True)
    rows = choose_poses(problem, theta, TORQUE_NOISE, 200)
    return PairMotion(own.select(rows), other.select(rows))


def _joined(motions: list[Motion]) -> Motion:
    arrays = (np.concatenate([getattr(m, name) for m in motions]) for name in ('q', 'dq', 'ddq'))
    return Motion(motions[0].joints, np.arange(float(sum(map(len, motions)))), *arrays)


def _planned(
    pair: TiedPair, motions: PairMotion, degrees: float, inertias: Inertias, separate: bool
) -> tuple[InteractionProblem, FloatArray]:
    """Return the regression on poses with exact torques, and its solution."""
    problem = interaction_problem(
        pair.machines,
        motions.own,
        motions.other,
        noise=MachineNoise(np.radians(degrees)),
        inertias=inertias,
        separate=separate,
    )
    columns = problem.columns.reshape(-1, problem.columns.shape[2])
    size = np.linalg.norm(columns, axis=0)
    aim = (problem.tau - problem.known).ravel()
    return problem, np.linalg.lstsq(columns / size, aim, rcond=None)[0] / size


def _bound(
    pair: TiedPair, motions: PairMotion, degrees: float, inertias: Inertias, separate: bool
) -> FloatArray:
    """Return the smallest possible scatter of an unbiased estimate [per cent]."""
    problem, theta = _planned(pair, motions, degrees, inertias, separate)
    return 100.0 * stiffness_bound(problem, theta, TORQUE_NOISE) / 1e4


def _judged(
    found: list[Interaction], degrees: float, inertias: Inertias, bound: FloatArray | None
) -> str:
    """Return a text of mean error, scatter and error of least squares, for the worst spring."""
    errors = np.array([100.0 * (part.stiffness / 1e4 - 1.0) for part in found])
    plain = errors + np.array([100.0 * part.bias / 1e4 for part in found])
    mean, scatter = errors.mean(axis=0), errors.std(axis=0, ddof=1)
    worst = int(np.argmax(np.abs(mean) + scatter))
    one = 1.0 if inertias == 'free' or degrees > 0.05 else 0.5
    count, wanted = ('one', one) if len(mean) == 1 else ('four', 5.0)
    least = '    -' if bound is None else f'{bound[worst]:5.2f}'
    return (
        f'{count:5s}  {mean[worst]:+7.2f} ({scatter[worst]:.2f})    {least}'
        f'    {plain.mean(axis=0)[worst]:+8.1f}        <= {wanted}'
        + (f'  (worst: {found[0].segments[worst]})' if len(mean) > 1 else '')
    )


if __name__ == '__main__':
    main()
