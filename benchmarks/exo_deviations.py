# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stated standard deviations of springs, compared with the scatter of repeats.

    python -m benchmarks.exo_deviations [--repeats 400] [--first-seed 0] [--row 6]

"""

from __future__ import annotations

import argparse

from armid_ros.identification.ties.problem import Inertias
from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.papers.exo.plant.leg_pair import leg_pair, PairMotion, stepping
import numpy as np

from benchmarks.exo_noise import find_springs, with_torques

STIFFNESS = 1e4
#: Repeats with poses per repeat with a recording, which takes ten times as long.
_SHARE = 4


def deviations(repeats: int, first: int = 0, only: int | None = None) -> None:
    """Print stated deviations over scatter, and the coverage of 95 % intervals."""
    pair, gait = leg_pair(STIFFNESS), read_gait()
    poses = stepping(pair, gait, np.linspace(0.0, 1.8, 201)[:-1])
    seconds = stepping(pair, gait, np.arange(0.0, 10.0, 1e-3))
    print(
        'stated deviation over scatter of repeats, 0.05 deg  wanted      measured  intervals hold'
    )
    rows: list[tuple[str, PairMotion, Inertias, bool, int]] = [
        ('200 poses', poses, 'known', False, repeats),
        ('200 poses', poses, 'free', False, repeats),
        ('200 poses', poses, 'known', True, repeats),
        ('10 s 1 kHz', seconds, 'known', False, repeats // _SHARE),
        ('10 s 1 kHz', seconds, 'known', True, repeats // _SHARE),
        ('10 s 1 kHz', seconds, 'free', True, repeats // (2 * _SHARE)),
    ]
    for data, motions, inertias, separate, count in rows if only is None else [rows[only - 1]]:
        ratio, spread, inside = stated(motions, inertias, separate, count, first)
        what = f'{data}, inertias {inertias}, {"four" if separate else "one"} k, {count} times'
        wanted = '0.95-1.05' if motions is poses and not separate else '        -'
        print(f'  {what:50s}{wanted}  {ratio:.2f} ± {spread:.2f}  {inside:.0f} %', flush=True)


def stated(
    motions: PairMotion, inertias: Inertias, separate: bool, repeats: int, first: int = 0
) -> tuple[float, float, float]:
    """Return stated over true deviation, its standard deviation, and the coverage [per cent]."""
    pair = leg_pair(STIFFNESS)
    exact = with_torques(pair, motions)
    found = [
        find_springs(pair, exact, 0.05, seed, inertias=inertias, separate=separate)
        for seed in range(first, first + repeats)
    ]
    values = np.array([part.stiffness for part in found])
    variance = np.mean([part.std**2 for part in found], axis=0)
    ratio = np.sqrt(variance) / values.std(axis=0, ddof=1)
    hold = [np.prod(np.sign(part.interval() - STIFFNESS), axis=1) <= 0.0 for part in found]
    sure = (2.0 * (len(values) - 1)) ** -0.5  # as for one spring: those of a draw are correlated
    return float(np.mean(ratio)), sure, 100.0 * float(np.mean(hold))


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--repeats', type=int, default=400, help='of 200 poses')
    parser.add_argument('--first-seed', type=int, default=0, help='of the noise')
    parser.add_argument('--row', type=int, choices=range(1, 7), help='one row of the table alone')
    asked = parser.parse_args()
    deviations(asked.repeats, asked.first_seed, asked.row)
