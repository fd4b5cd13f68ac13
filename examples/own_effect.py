# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify and diagnose an effect that the catalogue lacks: a hose with the torque tau = k q^3."""

from dataclasses import dataclass
from pathlib import Path

import armid_ros as ar
from armid_ros.diagnosis import diagnose, DiagnosisSettings
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
        """Return the derivative of the torque by k, dtau/dk = q^3."""
        return joint_columns(self, motion, motion.q**3)


arm = ar.ArmModel.of(URDF)
hose = Hose.on(arm.robot, ('elbow',))
run = ar.simulate(arm.with_effect(hose, [1.5]), torque_noise=0.05)

without = ar.identify(URDF, run, effects=FRICTION)
model = ar.identify(ar.ArmModel.of(URDF, effects=FRICTION).with_effect(hose), run)
print(f'without the hose {without.error_percent:.2f} %')
print(f'with the hose    {model.error_percent:.2f} %')
k = model.estimate.index('hose_stiffness', 'elbow')
print(
    f'stiffness {model.estimate.values[k]:.3f} ± {model.estimate.std[k]:.3f} N m/rad^3, true 1.5'
)
np.testing.assert_allclose(model.estimate.values[k], 1.5, rtol=0.1)

# A diagnosis names the hose, too, if the effect is one of its candidates.
plan = ar.design_excitation(URDF, duration=12.0, starts=1, iterations=10)
truth = arm.with_effect(hose, [1.5])
runs = [ar.simulate(truth, plan, torque_noise=0.05, rng=seed) for seed in (1, 2)]
candidates = DiagnosisSettings(own=(Hose,))
rng = np.random.default_rng(0)
print(diagnose(arm, runs[:1], validate=runs[1:], settings=candidates, rng=rng).summary)
