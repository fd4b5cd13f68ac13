# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify from a CSV file with columns of its own names, in degrees, with motor currents."""

from pathlib import Path

import armid_ros as ar
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')
GAIN = 4.0  # torque constant times gear [N m/A]

# A file such as a logger writes. Yours is there already.
run = ar.simulate(ar.ArmModel.of(URDF), torque_noise=0.05)
names = ['t_ms', *(f'{what}_{k}' for what in ('angle_deg', 'amps') for k in (1, 2, 3))]
columns = np.column_stack([1e3 * run.t, np.degrees(run.q), run.tau / GAIN])
np.savetxt('log.csv', columns, delimiter=',', header=','.join(names), comments='')

# Units in names are seen ('t_ms', 'angle_deg'); columns that no name tells are named here.
recording = ar.read_recording('log.csv', URDF, effort='amps_{}', effort_scale=GAIN)
print(recording)
print(ar.inspect(URDF, recording))
print(ar.identify(URDF, recording))
