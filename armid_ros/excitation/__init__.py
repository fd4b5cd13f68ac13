# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Excitation: trajectories that make the parameters of an arm identifiable.

`design` finds the `FourierTrajectory` that carries the most information on the parameters of an
`ArmModel`. The trajectory keeps the `Limits` of the robot and avoids collisions with itself and
with every `Obstacle`. An `Excitation` runs the trajectory from rest to rest.

"""

from armid_ros.excitation.design import Design, design, DesignProgress, evaluate
from armid_ros.excitation.feasibility import (
    excitation_faults,
    random_feasible,
    trajectory_faults,
)
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.gate import Ending, MotionGate
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.geometry.environment import (
    load_environment,
    Obstacle,
    obstacles_alone,
    with_obstacles,
)
from armid_ros.excitation.geometry.floor import find_floor, Floor, floor_obstacles
from armid_ros.excitation.limits import (
    check_limits,
    Limits,
    SPEED_CLASSES,
    with_joint_limits,
)
from armid_ros.excitation.pose_monitor import PoseMonitor
from armid_ros.excitation.problem import DesignProblem, DesignSettings, TARGETS, whole_period
from armid_ros.excitation.run import plan_run, Run
from armid_ros.excitation.scene import CollisionScene, Fitness, fitness
from armid_ros.excitation.schedule import Excitation, load_excitation, save_excitation
from armid_ros.excitation.search.criteria import CRITERIA, Information
from armid_ros.excitation.supervision import (
    jump_fault,
    MeasuredPose,
    Rehearsal,
    slowed,
    tracking_fault,
)
from armid_ros.excitation.transfer import Transfer, transfer_limits, TransferPlanner

__all__ = [
    'Rehearsal',
    'CRITERIA',
    'ClearanceModel',
    'CollisionScene',
    'Design',
    'DesignSettings',
    'Excitation',
    'Fitness',
    'Floor',
    'FourierTrajectory',
    'Information',
    'Limits',
    'MeasuredPose',
    'MotionGate',
    'PoseMonitor',
    'Obstacle',
    'DesignProblem',
    'DesignProgress',
    'Ending',
    'Run',
    'SPEED_CLASSES',
    'TARGETS',
    'Transfer',
    'TransferPlanner',
    'check_limits',
    'design',
    'evaluate',
    'excitation_faults',
    'find_floor',
    'fitness',
    'floor_obstacles',
    'jump_fault',
    'load_environment',
    'load_excitation',
    'obstacles_alone',
    'plan_run',
    'random_feasible',
    'save_excitation',
    'slowed',
    'tracking_fault',
    'trajectory_faults',
    'transfer_limits',
    'whole_period',
    'with_joint_limits',
    'with_obstacles',
]
