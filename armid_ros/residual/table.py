# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Maps as a table that any program can look up."""

from __future__ import annotations

from itertools import product

from armid_ros.files.cells import csv_cell
from armid_ros.residual.learn import Residual
import numpy as np

#: File beside model.yaml.
TABLE_FILE = 'residual.csv'
#: Grid of position, velocity and load.
_STEPS = (41, 31, 9)
_HEAD = 'joint,position,velocity,load,torque,std'


def lookup_table(residual: Residual) -> str:
    """
    Return the maps on a grid over the data as CSV, in SI units.

    Returns
    -------
    str
        Joint, position, velocity, load, torque and its standard deviation; the load is empty
        where it does not matter. Position varies slowest.

    """
    lines = [_HEAD]
    for one in residual.joints:
        axes = [one.axis(number, count) for number, count in enumerate(_STEPS)]
        loaded = one.learned.takes_load
        if not loaded:
            axes[2] = np.zeros(1)
        inputs = np.array(list(product(*axes)))
        torque, std = one.learned.torque(inputs), one.learned.std(inputs)
        name = csv_cell(one.joint)
        lines += [
            f'{name},{q:.6g},{dq:.6g},{f"{w:.6g}" if loaded else ""},{tau:.6g},{s:.4g}'
            for (q, dq, w), tau, s in zip(inputs, torque, std, strict=True)
        ]
    return '\n'.join(lines) + '\n'
