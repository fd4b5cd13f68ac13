# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the excitation publisher, and the excitation that they describe."""

from __future__ import annotations

from armid_ros.api.arguments import USUAL, with_effects
from armid_ros.arm import ArmModel, load_model
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import (
    CollisionScene,
    design,
    DesignSettings,
    Excitation,
    Limits,
    load_excitation,
    SPEED_CLASSES,
    trajectory_faults,
    TransferPlanner,
    whole_period,
    with_joint_limits,
)
from armid_ros.excitation.feasibility import excitation_faults
from armid_ros.files import reading
from armid_ros.nodes.parameters.table import NodeParameter, setting, Values
from armid_ros.robots import load_arms, load_robot
import numpy as np

SIMULATION = NodeParameter(
    'simulation',
    False,
    'The arm is simulated: by default the run begins without ~/start, and fast. '
    'use_sim_time has the same effect.',
)
#: All parameters of the excitation publisher.
PUBLISHER_PARAMETERS = (
    NodeParameter('robot', 'humanoid_arm', 'A shipped robot, or the path of a URDF or xacro.'),
    NodeParameter('gravity', 'earth', 'earth, moon, or x,y,z in the base frame [m/s^2].'),
    NodeParameter(
        'model',
        '',
        'model.yaml of the arm with its payload and friction, for the torque limits; empty: the '
        'rigid body of the description alone.',
    ),
    NodeParameter('joints', [''], 'Driven joints; if empty, the joints of arms.'),
    NodeParameter('joint_limits', '', 'joint_limits.yaml of MoveIt; empty: none.'),
    NodeParameter('velocity', [''], 'Velocity limits, joint:=value [rad/s or m/s].'),
    setting(
        'file',
        '',
        'Excitation to use (.yaml); empty: design one. A file set at run time is run by '
        'the next ~/start.',
    ),
    NodeParameter(
        'duration', 44.0, 'Length of the run, from rest to rest.', 's', limits=(1.0, 3600.0)
    ),
    NodeParameter('n_periods', 2, 'Number of identical periods.', limits=(1, 100)),
    NodeParameter('run_in', 2.0, 'Length of run-in and run-out.', 's', limits=(0.1, 60.0)),
    NodeParameter('harmonics', 5, 'Number of harmonics per joint.', limits=(1, 30)),
    NodeParameter(
        'speed',
        'slow',
        'Share of the velocity limits that a designed excitation and the approach use; fast by '
        'default in a simulation. An excitation from a file keeps its own speed.',
        choices=tuple(SPEED_CLASSES),
    ),
    NodeParameter('effects', USUAL.split(','), 'Effects to excite, with the rigid body.'),
    NodeParameter('clearance', 0.01, 'Distance kept between bodies.', 'm', limits=(0.0, 1.0)),
    NodeParameter(
        'floor',
        '',
        'Height of the floor above the origin of the base [m], or none; empty: the height shipped '
        'with the robot, or the base plane of an upright arm.',
    ),
    NodeParameter(
        'environment',
        '',
        'YAML of the obstacles around the arm, or a planning scene of MoveIt, as ros2 topic '
        'echo prints it; empty: none.',
    ),
    NodeParameter(
        'design_time', 20.0, 'Limit of processor time of the search.', 's', limits=(1.0, 86400.0)
    ),
    NodeParameter('seed', 0, 'Random seed of the search.', limits=(0, 2**62)),
    NodeParameter(
        'interface',
        'auto',
        'How trajectories are sent. action: as goals, which needs the package control_msgs. '
        'topic: as messages, which no controller answers. auto: by the action if a controller '
        'offers it when the run begins.',
        choices=('auto', 'topic', 'action'),
    ),
    NodeParameter(
        'action',
        '',
        'Name of the action; empty: follow_joint_trajectory in the namespace of the topic '
        'joint_trajectory.',
    ),
    setting(
        'goal_tolerance',
        0.0,
        'Tolerance of each joint at the end of the run, for the action; 0: default of the '
        'controller. The tolerance on the path is tracking_tolerance.',
        'rad or m',
        limits=(0.0, 10.0),
    ),
    setting(
        'goal_time_tolerance',
        0.0,
        'Largest delay of the end of the run; 0: default of the controller.',
        's',
        limits=(0.0, 60.0),
    ),
    NodeParameter('rate', 100.0, 'Waypoints per second.', 'Hz', limits=(1.0, 1000.0)),
    setting(
        'approach',
        3.0,
        'Shortest time of the approach to the first point; longer if distance and limits '
        'require it.',
        's',
        limits=(0.1, 60.0),
    ),
    setting(
        'speed_scaling',
        1.0,
        'Speed of ~/start as a share of the planned speed.',
        limits=(0.1, 1.0),
    ),
    setting(
        'rehearsal_speed',
        0.2,
        'Speed of ~/rehearse as a share of the planned speed.',
        limits=(0.05, 1.0),
    ),
    NodeParameter(
        'zero_stamp',
        False,
        'Send the run with a zero stamp, so that the controller begins at once: for a robot whose '
        'clock differs from that of this computer. Stops always have a zero stamp.',
    ),
    setting(
        'stopping',
        0.5,
        'Duration of a stop of the arm; longer if the limits of the arm require it. Without '
        'zero_stamp, the arm is not started if clocks differ by more than a tenth of this.',
        's',
        limits=(0.1, 10.0),
    ),
    SIMULATION,
    NodeParameter(
        'start',
        False,
        'Begin without ~/start, as soon as joint states arrive and a controller subscribes; true '
        'by default in a simulation only.',
    ),
    setting(
        'tracking_tolerance',
        0.2,
        'Distance of a joint from its planned position at which the arm is stopped.',
        'rad or m',
        limits=(0.001, 10.0),
    ),
    setting(
        'effort_factor',
        3.0,
        'Factor over the planned effort of a joint, and over 10 % of its limit, at which the '
        'arm is stopped after three samples. 0: never, the default in a simulation.',
        limits=(0.0, 1000.0),
    ),
    setting(
        'state_timeout',
        0.5,
        'Time without a joint state after which the arm is stopped or not started; 5 s by default '
        'in a simulation.',
        's',
        limits=(0.01, 10.0),
    ),
    NodeParameter(
        'subscriber_timeout',
        10.0,
        'How long a run waits for a subscriber and joint states; later it needs ~/start.',
        's',
        limits=(0.0, 3600.0),
    ),
)


def make_planner(value: Values) -> tuple[TransferPlanner, tuple[str, ...]]:
    """
    Return a path planner from ROS parameters, and the checks that the description does not allow.

    Parameters
    ----------
    value : callable
        Function from the name of one of `PUBLISHER_PARAMETERS` to its value.

    Returns
    -------
    planner : TransferPlanner
        Planner of the path to an excitation, with arm and obstacles.
    unchecked : tuple of str
        Checks that the description does not allow.

    Raises
    ------
    ArmidError
        If a file or robot does not exist, or the height of the floor is unknown.

    """
    robot, others = load_arms(
        lambda joints: load_robot(value('robot'), gravity=value('gravity'), joints=joints),
        value('joints') or None,
    )
    robot = with_joint_limits(robot, value('joint_limits'), value('velocity'))
    arm = load_model(value('model'), robot) if value('model') else ArmModel(robot)
    scene = CollisionScene.of(robot, value('clearance'), value('floor'), value('environment'))
    planner = TransferPlanner.of(arm, scene, value('speed'))
    unchecked = scene.unchecked
    if others:
        unchecked += (f'{", ".join(others)} (not driven, as they belong to no arm)',)
    return planner, unchecked


def make_excitation(value: Values, rate: float, planner: TransferPlanner) -> Excitation:
    """
    Load the excitation file that a ROS parameter names; without one, design an excitation.

    Parameters
    ----------
    value : callable
        Function from the name of one of `PUBLISHER_PARAMETERS` to its value.
    rate : float
        Rate at which the excitation will be sent [Hz].
    planner : TransferPlanner
        Planner with arm and obstacles.

    Raises
    ------
    ArmidError
        If the file does not exist, or the excitation violates limits or collides.

    """
    if value('file'):
        return checked(load_excitation(value('file')), planner, value('file'))
    arm = with_effects(planner.arm, ','.join(value('effects')))
    periods, run_in = value('n_periods'), value('run_in')
    settings = DesignSettings(
        period=whole_period(value('duration'), periods, run_in, rate),
        harmonics=value('harmonics'),
        n_periods=periods,
        run_in=run_in,
        speed=value('speed'),
        clearance=value('clearance'),
        starts=2,
        time_budget=value('design_time'),
    )
    rng = np.random.default_rng(value('seed'))
    return design(arm, settings, rng, collision=planner.clearance.collision).excitation


def checked(excitation: Excitation, planner: TransferPlanner, source: str) -> Excitation:
    """
    Check limits and collisions of an excitation; return it in the arm's joint order.

    For a joint without an acceleration limit, the limit of `Limits.of` is assumed.

    Parameters
    ----------
    excitation : Excitation
        Excitation from a file or a topic.
    planner : TransferPlanner
        Planner with arm and obstacles.
    source : str
        Origin of the excitation, for messages.

    Raises
    ------
    TrajectoryError
        If the excitation has other joints, violates limits or collides.

    """
    robot = planner.arm.robot
    with reading(source, TrajectoryError):
        excitation = excitation.for_joints(robot.joints)
    limits = Limits.of(robot, speed=1.0, reserve=False)
    faults = trajectory_faults(planner.arm, limits, excitation.trajectory, planner.clearance)
    faults = faults or excitation_faults(planner.arm, limits, excitation)
    if faults:
        assumed = np.isinf(robot.acceleration_limit).any() and 'acceleration' in str(faults)
        remedy = '; the parameter joint_limits sets other acceleration limits' * assumed
        raise TrajectoryError(f'{source}: {faults}{remedy}')
    return excitation
