# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An effect that the catalogue does not have: a hose that stiffens, tau = k q^3."""

from dataclasses import dataclass
from pathlib import Path

import armid_ros as ar
from armid_ros.effects import joint_columns
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')
FRICTION = 'viscous_friction,coulomb_friction,torque_offset'


@dataclass(frozen=True)
class Hose(ar.Effect):
    """A hose along a joint that stiffens as it bends, tau = k q^3."""

    name = 'hose'
    summary = 'hose that stiffens as it bends'
    quantities = (ar.Quantity('hose_stiffness', 'N m/rad^3', typical=(0.1, 10.0)),)

    def columns(self, motion, arm):
        """Return dtau/dk = q^3; the torque is k times that."""
        return joint_columns(self, motion, motion.q**3)


arm = ar.ArmModel.of(URDF)
hose = Hose.on(arm.robot, ('elbow',))
run = ar.simulate(arm.with_effect(hose, [1.5]), torque_noise=0.05)

without = ar.identify(URDF, run, effects=FRICTION)
model = ar.identify(ar.ArmModel.of(URDF, effects=FRICTION).with_effect(hose), run)
print(f'without the hose {without.error_percent:.2f} %')
print(f'with it          {model.error_percent:.2f} %')
k = model.estimate.index('hose_stiffness', 'elbow')
print(
    f'stiffness {model.estimate.values[k]:.3f} ± {model.estimate.std[k]:.3f} N m/rad^3, true 1.5'
)
np.testing.assert_allclose(model.estimate.values[k], 1.5, rtol=0.1)
