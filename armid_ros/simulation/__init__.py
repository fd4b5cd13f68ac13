# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The simulated arm: a plant with friction that sticks, a controller, drives and sensors.

`simulate` runs an arm along a reference and records it. `SimulatedArm` stands there and takes
trajectories while time goes on. `step` is one step of the plant alone. Joints are rigid unless a
plant is given `Elasticity`.

"""

from armid_ros.simulation.controller import ComputedTorque, Controller, GravityPD
from armid_ros.simulation.integrator import step
from armid_ros.simulation.motor_control import MotorControl
from armid_ros.simulation.plant import Plant, State
from armid_ros.simulation.reference import Reference
from armid_ros.simulation.run import simulate, SimulatedRun
from armid_ros.simulation.sensors import Sensors
from armid_ros.simulation.simulated_arm import Sample, SimulatedArm
from armid_ros.simulation.springs import Elasticity

__all__ = [
    'simulate',
    'SimulatedRun',
    'SimulatedArm',
    'Sample',
    'Reference',
    'Controller',
    'ComputedTorque',
    'GravityPD',
    'MotorControl',
    'Sensors',
    'Plant',
    'Elasticity',
    'State',
    'step',
]
