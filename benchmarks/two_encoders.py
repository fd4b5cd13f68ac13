# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Stiffness of a real arm with two encoders per joint, and its distinction from free play.

The arm is a KUKA KR300, axes 1 to 3, with three recordings of 10 s (Weigand et al. 2021) in the
folder of the environment variable ARMID_DATA.

"""

from __future__ import annotations

from pathlib import Path

from armid_ros.papers.elastic.identification.joints import fit_transmission, TwoEncoders
import numpy as np
from scipy.io import loadmat

from benchmarks.real_recordings import folder

GEAR = (1798 / 7, 1872 / 7, 757 / 3)
PERIOD = 4e-3


def kr300(data: Path, axis: int) -> list[TwoEncoders]:
    """Return the three recordings of an axis, 0 to 2, at the joint and in SI units."""
    records = []
    for name in 'ABC':
        path = data / 'kuka_kr300_weigand' / 'data' / f'recorded_FF_{name}.mat'
        rec = loadmat(path, struct_as_record=False, squeeze_me=True)['rec']
        records.append(
            TwoEncoders(
                PERIOD,
                np.radians(rec.act_pos_mot_deg[axis]),
                np.radians(rec.act_pos_se_deg[axis]),
                GEAR[axis] * rec.act_torque_abs_nm[axis],
            )
        )
    return records


def main() -> None:
    """Print the table."""
    for axis in range(3):
        fit = fit_transmission(kr300(folder(), axis), np.random.default_rng(0))
        value, low, high = (1e-6 * x for x in fit.stiffness)
        play = ', '.join(f'{np.degrees(x):.4f}' for x in fit.backlash)
        delay = ', '.join(f'{1e3 * x:.2f}' for x in fit.delay)
        print(
            f'axis {axis + 1}: K {value:.1f} [{low:.1f}, {high:.1f}] 1e6 N m/rad, backlash '
            f'[{play}] deg, correlation {fit.correlation:.2f}, {fit.reversals} reversals of load, '
            f'encoders apart by [{delay}] ms, R2 {fit.explained:.3f}'
        )


if __name__ == '__main__':
    main()
