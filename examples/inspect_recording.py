# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Inspect a recording before its use: gaps, wrong units, and whether armid identify accepts it."""

from dataclasses import replace
from pathlib import Path

import armid_ros as ar
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')

good = ar.simulate(ar.ArmModel.of(URDF), torque_noise=0.05)
holes = good.select(np.r_[0:800, 1000 : len(good)])
spoiled = replace(holes, dq=np.degrees(holes.dq), tau=1e3 * holes.tau, source='spoiled')

found = ar.inspect(URDF, spoiled)
print(found)
for remark in found.remarks:
    print('-', remark)
print(found.report('inspection.html'), 'shows all curves')
