# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify the stiffness of joints from encoders at the motors and at the links."""

from pathlib import Path

import armid_ros as ar
from armid_ros.papers.elastic.identification.joints import fit_springs
from armid_ros.simulation import Reference, Sensors
from armid_ros.simulation.elastic import make_simulated_arm
from armid_ros.simulation.run import record
import numpy as np

URDF = Path(__file__).with_name('arm.urdf')

# The simulated robot has joint springs of 4000 N m/rad, and motors with inertia.
compliance = 'joint_elasticity:compliance=0.00025'
robot = ar.ArmModel.of(URDF, effects=[compliance, 'rotor_inertia:rotor_inertia=0.5'])
plan = ar.design_excitation(URDF, duration=12.0, starts=1, iterations=10)
encoders = Sensors(position_noise=1e-5, torque_noise=0.05)
rng = np.random.default_rng(1)
elastic = make_simulated_arm(robot, rng=rng, warn=print, sensors=encoders)
run = record(elastic, Reference.of(plan.motion(1000.0)), rate=500.0).sides

motors, links = (
    ar.Recording(joints=side.joints, t=side.t, q=side.q, tau=side.tau)
    for side in (run.motor, run.link)
)
for joint in fit_springs(ar.load_robot(URDF), [(motors, links)]):
    value, low, high = joint.transmission.stiffness
    print(f'{joint.joint:9s} {value:6.0f} N m/rad ({low:.0f} to {high:.0f}), true 4000')
