# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find the tilt of a base, 3 degrees, that the description assumes to be upright."""

from pathlib import Path

import armid_ros as ar
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')
FRICTION = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')
tilt = np.radians(3.0)

truth = ar.ArmModel.of(
    URDF, effects=FRICTION, gravity=(9.81 * np.sin(tilt), 0.0, -9.81 * np.cos(tilt))
)
known = ar.ArmModel.of(URDF, effects=FRICTION)
plan = ar.design_excitation(known, duration=12.0, starts=1, iterations=10)
runs = [ar.simulate(truth, plan, torque_noise=0.05, rng=seed) for seed in (1, 2)]

found = ar.diagnose(known, runs[0], validate=runs[1])
print(found)
found.report('askew.html')
