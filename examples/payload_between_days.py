# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Find the mass of a load that was bolted to the arm between Monday and Friday."""

from pathlib import Path

import armid_ros as ar

URDF = Path(__file__).with_name('arm.urdf')
FRICTION = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')
INERTIA = 'payload_Ixx=0.04,payload_Iyy=0.04,payload_Izz=0.001'
LOAD = f'payload@elbow:payload_m=0.4,payload_mz=0.12,{INERTIA}'

plan = ar.design_excitation(URDF, duration=12.0, starts=1, iterations=10)
free = ar.ArmModel.of(URDF, effects=FRICTION)
loaded = ar.ArmModel.of(URDF, effects=[*FRICTION, LOAD])
monday = ar.simulate(free, plan, torque_noise=0.05, rng=1)
friday = ar.simulate(loaded, plan, torque_noise=0.05, rng=2)

# Compare the identifications of two days ...
changed = ar.compare(ar.identify(URDF, monday), ar.identify(URDF, friday))
print(changed)
print(f'added: {changed.load:.2f} kg')

# ... or diagnose Friday's recording with Monday's model.
print(ar.diagnose(ar.identify(URDF, monday), friday))
