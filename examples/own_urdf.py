# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Excite, record and identify the arm of a URDF, and write a report."""

from pathlib import Path
import sys

import armid_ros as ar

URDF = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).with_name('arm.urdf')

# 1. Design a trajectory inside all limits; out/plan has the trajectory as YAML, CSV and bag.
plan = ar.design_excitation(URDF, duration=12.0, starts=2, iterations=10)
print(plan)
plan.save('out/plan')

# 2. Run the trajectory and record /joint_states; here a simulated arm replaces the robot.
friction = ('viscous_friction:viscous_coefficient=0.3', 'coulomb_friction:coulomb_torque=0.2')
robot = ar.ArmModel.of(URDF, effects=friction)
monday, tuesday = (ar.simulate(robot, plan, torque_noise=0.05, rng=day) for day in (1, 2))

# 3. Fit one recording and predict the other, with physically consistent links for simulators.
model = ar.identify(URDF, monday, validate=tuesday, physical=True)
print(model)
print(model.save('out/model'), 'has report.html, model.yaml and identified.urdf')
