# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Do deviations of four springs in a recording hold? What noise does to the estimate, linearised.

A whole identification takes seconds, and fifty repeats leave a ratio of deviation and scatter
uncertain by a tenth. What noise does to the residuals at the true parameters takes a twentieth of
that, and the estimate is linear in it but for a few per cent.

    python -m benchmarks.exo_linear [--repeats 400] [--first-seed 1000]

"""

from __future__ import annotations

import argparse

from armid_ros.identification.rows.signals import SignalSettings
from armid_ros.identification.ties.problem import Inertias, InteractionProblem
from armid_ros.identification.ties.recorded import recorded_interaction_problem
from armid_ros.model.spring_ties import SEGMENTS
from armid_ros.motion import FloatArray
from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.papers.exo.plant.leg_pair import leg_pair, PairMotion, stepping, TiedPair
import numpy as np

from benchmarks.exo_noise import measured, recorded, with_torques

STIFFNESS, DEGREES = 1e4, 0.05
#: What is chosen for such recordings, held fixed: filters of their own make columns of their own.
SETTINGS = SignalSettings(cutoff_hz=13.0, decimation=38)


def main() -> None:
    """Print stated deviations, the scatter of the linearised estimate, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--repeats', type=int, default=400)
    parser.add_argument('--first-seed', type=int, default=1000)
    asked = parser.parse_args()
    pair = leg_pair(STIFFNESS)
    exact = with_torques(pair, stepping(pair, read_gait(), np.arange(0.0, 10.0, 1e-3)))
    seeds = range(asked.first_seed, asked.first_seed + asked.repeats)
    noisy = _problem(pair, measured(exact, DEGREES, np.random.default_rng(0)), 'known')
    theta = np.full(len(SEGMENTS), STIFFNESS)
    residuals = [
        _problem(pair, measured(exact, DEGREES, np.random.default_rng(seed)), 'known').residual(
            theta
        )
        for seed in seeds
    ]
    print('10 s at 1 kHz, 0.05 deg, four k [N/m]:', ', '.join(SEGMENTS))
    for inertias in ('known', 'free'):
        pull, stated = _linearised(_problem(pair, exact, inertias), noisy, theta)
        off = np.array([np.einsum('pni,ni->p', pull, rest) for rest in residuals])
        scatter = off.std(axis=0, ddof=1)
        ratio = stated / scatter
        print(
            f'  inertias {inertias}: stated {_four(stated)}, scatter {_four(scatter)}, '
            f'ratio {_four(ratio)}, mean {ratio.mean():.3f} +- '
            f'{1.0 / np.sqrt(2.0 * len(off)):.3f}'
        )


def _problem(pair: TiedPair, motions: PairMotion, inertias: Inertias) -> InteractionProblem:
    return recorded_interaction_problem(
        pair.machines,
        recorded(motions.own),
        recorded(motions.other),
        inertias=inertias,
        separate=True,
        settings=SETTINGS,
    )


def _linearised(
    clean: InteractionProblem, noisy: InteractionProblem, theta: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return what residuals do to the stiffnesses, (S, N, n), and their stated deviations."""
    by_motion, variance = noisy.sensitivity(theta), noisy.torque_noise**2
    covariance = by_motion @ noisy.motion_noise @ by_motion.transpose(0, 2, 1) + np.diag(variance)
    weighted = np.linalg.solve(covariance, clean.columns)
    information = np.einsum('nip,niq->pq', clean.columns, weighted)
    moved = np.einsum('nij,nip->npj', by_motion, weighted)
    scores = information.copy()
    for lag in range(1, len(noisy.torque_lags)):
        alike = np.einsum('npj,jk,nqk->pq', moved[:-lag], noisy.motion_lags[lag], moved[lag:])
        torque = noisy.torque_lags[lag] * variance
        alike += np.einsum('nip,i,niq->pq', weighted[:-lag], torque, weighted[lag:])
        scores += alike + alike.T
    inverse = np.linalg.inv(information + clean.precision)
    count = len(theta)
    stated = np.sqrt(np.diag(inverse @ scores @ inverse))[:count]
    return np.einsum('pq,niq->pni', inverse[:count], weighted), stated


def _four(values: FloatArray) -> str:
    return ' '.join(f'{value:.3g}' for value in values)


if __name__ == '__main__':
    main()
