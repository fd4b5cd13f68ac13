# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Duration of `make test` in seconds, and in units of a fixed loop of the same computer."""

import os
import sys
import time

import numpy as np


def loop() -> float:
    """Return the processor time of a fixed loop of interpreted steps and linear algebra [s]."""
    begin, total = time.process_time(), 0.0
    for k in range(3_000_000):
        total += k * 0.5
    matrix = np.eye(100) + np.arange(10_000.0).reshape(100, 100) / 1e6
    for _ in range(500):
        np.linalg.solve(matrix, matrix)
    return time.process_time() - begin


def processor() -> str:
    """Return the model name of the processor."""
    with open('/proc/cpuinfo', encoding='utf-8') as info:
        names = (line.split(': ')[1] for line in info if line.startswith('model name'))
        return next(names, '?').strip()


if __name__ == '__main__':
    took, reference = time.time() - float(sys.argv[1]), min(loop() for _ in range(5))
    print(
        f'the tests took {took:.0f} s on {os.cpu_count()} cores of {processor()}, '
        f'{took / reference:.0f} times a reference loop of {reference:.2f} s'
    )
