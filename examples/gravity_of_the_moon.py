# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find the gravity of an arm that is described on Earth and recorded on the Moon."""

from pathlib import Path

import armid_ros as ar

URDF = Path(__file__).with_name('arm.urdf')
FRICTION = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')

on_the_moon = ar.ArmModel.of(URDF, effects=FRICTION, gravity='moon')
described = ar.ArmModel.of(URDF, effects=FRICTION, gravity='earth')
plan = ar.design_excitation(described, duration=12.0, starts=1, iterations=10)
runs = [ar.simulate(on_the_moon, plan, torque_noise=0.02, rng=seed) for seed in (1, 2)]

print(ar.diagnose(described, runs[0], validate=runs[1]))
