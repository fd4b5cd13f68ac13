# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Simulated arm: plant with stick-slip friction, controller, drives and sensors.

`simulate` records an arm that follows a reference. A `SimulatedArm` accepts trajectories
while simulated time advances. `step` integrates one step of the plant. Joints are rigid unless the
plant has an `Elasticity`.

"""

from armid_ros.robots.reference import Reference
from armid_ros.simulation.controller import ComputedTorque, Controller, MotorControl
from armid_ros.simulation.integrator import step
from armid_ros.simulation.plant import Plant, State
from armid_ros.simulation.run import simulate, SimulatedRun
from armid_ros.simulation.sensors import Sensors
from armid_ros.simulation.simulated_arm import SimulatedArm
from armid_ros.simulation.springs import Elasticity

__all__ = [
    'simulate',
    'SimulatedRun',
    'SimulatedArm',
    'Reference',
    'Controller',
    'ComputedTorque',
    'MotorControl',
    'Sensors',
    'Plant',
    'Elasticity',
    'State',
    'step',
]
