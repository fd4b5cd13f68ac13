# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The human-exoskeleton leg pair: gait by torque in MuJoCo, stiffness from noisy angles.

What the source claims, what is wanted here, what is measured.

    python -m benchmarks.exo [--draws 8] [--sets 24]

"""

from __future__ import annotations

import argparse
from dataclasses import replace

from armid_ros.identification.interaction import identify_interaction, Interaction
from armid_ros.identification.interaction_problem import Inertias, interaction_problem
from armid_ros.identification.interaction_recording import recorded_interaction_problem
from armid_ros.identification.interaction_search import find_interaction, InteractionFinding
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.simulation.gait import read_gait
from armid_ros.simulation.leg_pair import (
    leg_pair,
    pair_torques,
    PairMotion,
    SEGMENTS,
    stepping,
    TiedPair,
    walking,
)
from armid_ros.simulation.torque_driven import splined
import numpy as np

from benchmarks.leg_pair_in_mujoco import drive_in_mujoco

TORQUE_NOISE = 0.5
SECONDS = 6.0
#: Hidden springs: which segments, at each of the stiffnesses.
HIDDEN = (
    SEGMENTS,
    ('swing_shank',),
    ('swing_thigh',),
    ('stance_thigh',),
    ('swing_shank', 'stance_shank'),
    ('swing_thigh', 'stance_thigh'),
)
STIFFNESSES = (1e3, 3e3, 1e4, 5e4)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--draws', type=int, default=8, help='noise drawn so many times')
    parser.add_argument('--sets', type=int, default=24, help='recordings with hidden springs')
    asked = parser.parse_args()
    gait_by_torque()
    stiffness(asked.draws)
    hidden(asked.sets)


def gait_by_torque() -> None:
    """Drive joints by 100 Hz splined torques in MuJoCo over single support."""
    pair, gait = leg_pair(), read_gait()
    motions = walking(pair, gait, np.linspace(0.0, 0.456, 457))
    soft = pair.with_stiffness(0.8 * pair.stiffness)
    print('in MuJoCo, one joint by its torque        paper    wanted    measured')
    for joint, paper, wanted in (('exo_swing_hip', 1.5, 0.05), ('exo_swing_knee', 2.5, 0.1)):
        error = _error(pair, motions, [joint], pair, 100.0)
        print(f'  {joint:38s} {paper:4.1f} deg <= {wanted:4.2f} deg  {error:.1e} deg')
    for joint, wanted in (('exo_swing_hip', 0.6), ('exo_swing_knee', 1.7)):
        error = _error(pair, motions, [joint], soft, 100.0)
        what = f'{joint}, springs 20 % too soft'
        print(f'  {what:38s}     -  about {wanted:3.1f} deg  {error:.2f} deg')
    whole = walking(pair, gait, np.linspace(0.0, 1.2, 1201), 0.0)
    for rate, share in ((50.0, 1.0), (100.0, 1.0), (400.0, 1.0), (400.0, 1.01)):
        error = _error(pair, whole, pair.robot.joints, pair, rate, share)
        what = f'all joints, one cycle, {rate:.0f} Hz' + (
            ', torques 1 % off' if share != 1 else ''
        )
        print(f'  {what:38s}     -           -  {error:.2g} deg')


def _error(
    pair: TiedPair,
    motions: PairMotion,
    joints: list[str] | tuple[str, ...],
    believed: TiedPair,
    rate: float,
    share: float = 1.0,
) -> float:
    columns = [pair.robot.index(joint) for joint in joints]
    tau = share * pair_torques(believed, *motions).tau[:, columns]
    path = drive_in_mujoco(pair, motions, joints, splined(motions.own.t, tau, rate))
    return float(np.degrees(np.abs(path - motions.own.q[:, columns]).max()))


def stiffness(draws: int) -> None:
    """Find the springs from 200 poses and from a recording, with noise."""
    pair, gait = leg_pair(1e4), read_gait()
    poses = stepping(pair, gait, np.linspace(0.0, 1.8, 201)[:-1])
    seconds = stepping(pair, gait, np.arange(0.0, 10.0, 1e-3))
    tau = {id(m): pair_torques(pair, *m).tau for m in (poses, seconds)}
    print(
        f'stiffness, {TORQUE_NOISE} N m noise: mean error (scatter) of {draws} draws in per cent'
    )
    print('  data       angles   inertias  springs       this          least squares    wanted')
    for degrees in (0.05, 0.1):
        for inertias in ('known', 'free'):
            for separate in (False, True):
                for data, motions in (('200 poses', poses), ('10 s 1 kHz', seconds)):
                    found = [
                        _find(pair, motions, tau[id(motions)], degrees, draw, inertias, separate)
                        for draw in range(draws)
                    ]
                    line = f'  {data:10s} {degrees:4.2f} deg  {inertias:5s}  '
                    print(line + _judged(found, degrees, inertias))


def _judged(found: list[Interaction], degrees: float, inertias: Inertias) -> str:
    """Return mean error, scatter and what plain least squares gives, of the worst spring."""
    errors = np.array([100.0 * (part.stiffness / 1e4 - 1.0) for part in found])
    plain = errors + np.array([100.0 * part.bias / 1e4 for part in found])
    mean, scatter = errors.mean(axis=0), errors.std(axis=0)
    worst = int(np.argmax(np.abs(mean) + scatter))
    one = 1.0 if inertias == 'free' or degrees > 0.05 else 0.5
    count, wanted = ('one', one) if len(mean) == 1 else ('four', 5.0)
    return (
        f'{count:5s}  {mean[worst]:+7.2f} ({scatter[worst]:.2f})'
        f'      {plain.mean(axis=0)[worst]:+8.1f}        <= {wanted}'
        + (f'  (worst: {found[0].segments[worst]})' if len(mean) > 1 else '')
    )


def _find(
    pair: TiedPair,
    motions: PairMotion,
    tau: FloatArray,
    degrees: float,
    seed: int,
    inertias: Inertias,
    separate: bool,
) -> Interaction:
    own, other = _measured(motions, tau, degrees, np.random.default_rng(seed))
    if len(own) < 1000:
        problem = interaction_problem(
            pair.robot,
            own,
            pair.other,
            other,
            pair.ties,
            position_noise=np.radians(degrees),
            inertias=inertias,
            separate=separate,
        )
        return identify_interaction(problem, TORQUE_NOISE)
    recordings = _recorded(own), _recorded(other)
    return identify_interaction(
        recorded_interaction_problem(
            pair.robot,
            recordings[0],
            pair.other,
            recordings[1],
            pair.ties,
            inertias=inertias,
            separate=separate,
        )
    )


def hidden(sets: int) -> None:
    """Hide springs in recordings, and none in as many others."""
    gait, every = read_gait(), leg_pair()
    t = np.arange(0.0, SECONDS, 1e-3)
    motions = stepping(every, gait, t)
    cases = [(k, segments) for k in STIFFNESSES for segments in HIDDEN][:sets]
    right = alarms = 0
    closed = []
    for number, (k, segments) in enumerate(cases):
        found = _search(every, leg_pair(k, segments), motions, number)
        right += set(found.segments) == set(segments)
        closed.append(found.closed_fraction)
        if set(found.segments) != set(segments):
            print(f'  {k:g} N/m at {", ".join(segments)}: named {", ".join(found.segments)}')
    for number in range(sets):
        found = _search(every, every.with_stiffness(0.0), motions, 1000 + number)
        alarms += len(found.segments) > 0
    print('hidden interaction, 1e3 to 5e4 N/m          wanted   measured')
    print(f'  segments named right                      {sets}/{sets}    {right}/{sets}')
    print(f'  named where there is none                 0/{sets}     {alarms}/{sets}')
    least, median = min(closed), np.median(closed)
    print(f'  held-out gap closed, least and median     -        {least:.3f}, {median:.3f}')


def _search(every: TiedPair, real: TiedPair, motions: PairMotion, seed: int) -> InteractionFinding:
    rng = np.random.default_rng(seed)
    tau = pair_torques(real, *motions).tau
    runs = [tuple(map(_recorded, _measured(motions, tau, 0.05, rng))) for _ in range(2)]
    return find_interaction(every.robot, every.other, every.ties, runs[0], runs[1])


def _measured(
    motions: PairMotion, tau: FloatArray, degrees: float, rng: np.random.Generator
) -> PairMotion:
    own, other = (
        replace(m, q=m.q + np.radians(degrees) * rng.normal(size=m.q.shape)) for m in motions
    )
    return PairMotion(own.with_torque(tau + TORQUE_NOISE * rng.normal(size=tau.shape)), other)


def _recorded(motion: Motion) -> Recording:
    return Recording(joints=motion.joints, t=motion.t, q=motion.q, tau=motion.tau)


if __name__ == '__main__':
    main()
