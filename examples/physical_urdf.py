# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Write a URDF for simulators: physically consistent links with a known total mass."""

from pathlib import Path

import armid_ros as ar
from armid_ros.identification import PhysicalSettings

URDF = Path(__file__).with_name('arm.urdf')

run = ar.simulate(ar.ArmModel.of(URDF), torque_noise=0.05)
model = ar.identify(URDF, run, physical=PhysicalSettings(total_mass=5.0))
model.urdf('identified.urdf')

robot = ar.load_robot('identified.urdf')
for link, mass in zip(robot.links, robot.rigid_parameters[::10], strict=True):
    print(f'{link:10s} {mass:.3f} kg')
print(f'together   {robot.rigid_parameters[::10].sum():.3f} kg')
