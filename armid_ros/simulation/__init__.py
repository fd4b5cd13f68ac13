# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The simulated arm: a plant with friction that sticks, a controller, drives and sensors.

`simulate` runs an arm along a reference and records it. `SimulatedArm` stands there and takes
trajectories while time goes on. `step` is one step of the plant alone.

"""

from armid_ros.simulation.controller import ComputedTorque, Controller, GravityPD
from armid_ros.simulation.integrator import step
from armid_ros.simulation.plant import Plant, State
from armid_ros.simulation.reference import Reference
from armid_ros.simulation.run import simulate, SimulatedRun
from armid_ros.simulation.sensors import Sensors
from armid_ros.simulation.simulated_arm import Sample, SimulatedArm

__all__ = [
    'simulate',
    'SimulatedRun',
    'SimulatedArm',
    'Sample',
    'Reference',
    'Controller',
    'ComputedTorque',
    'GravityPD',
    'Sensors',
    'Plant',
    'State',
    'step',
]
