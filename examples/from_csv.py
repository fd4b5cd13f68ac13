# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify from a CSV file with positions in degrees and motor currents in amperes."""

from pathlib import Path

import armid_ros as ar
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')
GAIN = 4.0  # torque constant times gear [N m/A]

# A file as a data logger writes it. For your own log, leave out this part.
run = ar.simulate(ar.ArmModel.of(URDF), torque_noise=0.05)
names = ['t_ms', *(f'{what}_{k}' for what in ('angle_deg', 'amps') for k in (1, 2, 3))]
columns = np.column_stack([1e3 * run.t, np.degrees(run.q), run.tau / GAIN])
np.savetxt('log.csv', columns, delimiter=',', header=','.join(names), comments='')

# Units in column names are converted ('t_ms', 'angle_deg'); the columns of currents are named.
recording = ar.read_recording('log.csv', URDF, effort='amps_{}', effort_scale=GAIN)
print(recording)
print(ar.inspect(URDF, recording))
print(ar.identify(URDF, recording))
