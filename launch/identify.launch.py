# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Excite, record, identify and diagnose an arm, write the reports, and end.

THE ARM MOVES: `ros2 launch armid_ros identify.launch.py robot:=my_arm.urdf` begins as soon as a
controller and joint states are available. `simulate:=true` moves a simulated arm instead.

"""

from pathlib import Path

from armid_ros.nodes.running.launching import Argument, described, node, SIMULATED_DRIVES
from launch.actions import Shutdown

ARGUMENTS = (
    Argument('robot', str, 'shipped robot, URDF or xacro; empty: the robot of params_file'),
    Argument('gravity', str, 'earth, moon, or x,y,z in the base frame [m/s^2]'),
    Argument(
        'joints',
        list,
        'driven joints, separated by commas; empty: all joints except those of grippers',
    ),
    Argument(
        'effects',
        list,
        'effects added to the rigid body, separated by commas; empty: friction and offset',
    ),
    Argument('save_to', str, 'folder for recordings, model and reports; empty: identification'),
    Argument('namespace', str, 'namespace of the nodes and of the topics of the robot'),
    Argument(
        'controller',
        str,
        'namespace of the topic and action of the controller; empty: none',
        'joint_trajectory_controller',
    ),
    Argument('joint_states', str, 'topic with the joint states of the robot', 'joint_states'),
    Argument('robot_description', str, 'topic with the URDF of the robot', 'robot_description'),
    Argument('effort_topic', str, 'topic with torques, if joint_states have none'),
    Argument('params_file', str, 'parameter file of the nodes; empty: config/real_robot.yaml'),
    Argument('use_sim_time', bool, 'take the time from /clock'),
    Argument('file', str, 'excitation file of armid excite; empty: design an excitation'),
    Argument('environment', str, 'obstacles around the arm: YAML file or MoveIt scene'),
    Argument(
        'floor', str, 'height of the floor above the base [m], or none; empty: that of the robot'
    ),
    Argument('duration', float, 'duration of a designed excitation [s]; empty: 44.0'),
    Argument('runs', int, 'number of runs, the last of several is held out; empty: 2'),
    Argument('rehearse', bool, 'first run slowly; continue only if the arm moves as predicted'),
    Argument('diagnose', bool, 'also find effects that the model lacks; empty: true'),
    Argument('simulate', bool, 'simulate an arm with friction and noise; no robot moves'),
)


def generate_launch_description():
    """Return the launch description; `ros2 launch ... --show-args` lists its arguments."""
    return described(ARGUMENTS, start)


def start(given):
    """Return the launch actions of the nodes for the given arguments."""

    def some(*names):
        """Return the given arguments of some names."""
        return {name: given[name] for name in names if name in given}

    def one(name, chosen, usual, remapped=(), **more):
        remappings = list(dict(remapped).items())
        return node(given, name, chosen, usual, shipped=shipped, remappings=remappings, **more)

    simulate = given.get('simulate', False)
    shipped = '' if simulate else str(Path(__file__).parents[1] / 'config' / 'real_robot.yaml')
    if not simulate and not {'robot', 'params_file'} & given.keys():
        raise RuntimeError('robot is missing: add robot:=URDF, or a params_file with robot')
    unnamed = {} if simulate else {'robot': ''}  # no default robot
    topics = some('joint_states', 'robot_description')
    own, simulation = dict(topics), {'simulation': True} if simulate else {}
    if 'effort_topic' in given:
        topics['joint_states'] = 'joint_state_merger/joint_states'
    if 'controller' in given and not simulate:
        topics['joint_trajectory'] = f'{given["controller"]}/joint_trajectory'
    folder = Path(given.get('save_to', 'identification')).expanduser()
    live, run = {'save_to': str(folder / 'live')}, {'save_to': str(folder)}
    bag = {'bag': str(folder / 'run')}
    saved = 'save_to' in given  # takes precedence over the parameter file
    arm, effects = some('robot', 'gravity', 'joints'), some('effects')
    design = some('file', 'environment', 'floor', 'duration')
    steps = some('runs', 'rehearse', 'diagnose')
    recorded = {'record': False, 'topics': list(topics.values())}
    excitation = arm | effects | design | simulation
    chosen = arm | effects | steps | (run if saved else {})
    nodes = [
        one('excitation_publisher', excitation, {'start': False} | unnamed, topics),
        one('online_identifier', arm | effects | (live if saved else {}), live, topics),
        one('recorder', bag if saved else {}, bag | recorded),
        one('identification_run', chosen, run | unnamed, on_exit=Shutdown()),
    ]
    if 'effort_topic' in given:
        nodes.append(one('joint_state_merger', some('effort_topic', 'joints'), {}, own))
    if simulate:
        nodes.append(one('simulated_arm', some('robot', 'gravity'), SIMULATED_DRIVES, topics))
    return nodes
