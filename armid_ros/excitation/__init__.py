# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Excitation: trajectories that make the parameters of an arm identifiable.

`design` finds the `FourierTrajectory` that carries the most information on the parameters of an
`ArmModel`. The trajectory keeps the `Limits` of the robot and avoids collisions with itself and
with every `Obstacle`. An `Excitation` runs the trajectory from rest to rest.

"""

from armid_ros.excitation.design import Design, design, evaluate, Progress
from armid_ros.excitation.feasibility import random_feasible, trajectory_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.geometry.environment import load_environment, Obstacle, with_obstacles
from armid_ros.excitation.geometry.floor import Floor
from armid_ros.excitation.limits import check_limits, Limits, SPEED_CLASSES, with_joint_limits
from armid_ros.excitation.problem import DesignProblem, DesignSettings, TARGETS, whole_period
from armid_ros.excitation.run import plan_run, Run
from armid_ros.excitation.scene import CollisionScene, Fitness, fitness
from armid_ros.excitation.schedule import Excitation, load_excitation, save_excitation
from armid_ros.excitation.search.criteria import CRITERIA
from armid_ros.excitation.transfer import transfer_limits, TransferPlanner

__all__ = [
    'CRITERIA',
    'ClearanceModel',
    'CollisionScene',
    'Design',
    'DesignSettings',
    'Excitation',
    'Fitness',
    'Floor',
    'FourierTrajectory',
    'Limits',
    'Obstacle',
    'DesignProblem',
    'Progress',
    'Run',
    'SPEED_CLASSES',
    'TARGETS',
    'TransferPlanner',
    'check_limits',
    'design',
    'evaluate',
    'fitness',
    'load_environment',
    'load_excitation',
    'plan_run',
    'random_feasible',
    'save_excitation',
    'trajectory_faults',
    'transfer_limits',
    'whole_period',
    'with_joint_limits',
    'with_obstacles',
]
