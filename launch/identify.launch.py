# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identify an arm from the excitation to the report, and end.

THE ARM MOVES: `ros2 launch armid_ros identify.launch.py robot:=my_arm.urdf` begins as soon as a
controller and joint states are there. `simulate:=true` tries it on a simulated arm first.

"""

from pathlib import Path

from armid_ros.nodes.running.launching import Argument, described, node, SIMULATED_DRIVES
from launch.actions import Shutdown

ARGUMENTS = (
    Argument('robot', str, 'shipped name, URDF or xacro; empty: that of params_file'),
    Argument('gravity', str, 'earth, moon, or x,y,z in the frame of the base [m/s^2]'),
    Argument('joints', list, 'driven joints, with commas; empty: all but those of grippers'),
    Argument('effects', list, 'beside the rigid body, with commas; empty: friction and offset'),
    Argument('save_to', str, 'folder for recordings, model and reports; empty: identification'),
    Argument('namespace', str, 'of the nodes and of the topics of the robot'),
    Argument(
        'controller', str, 'of its topic and action; empty: neither', 'joint_trajectory_controller'
    ),
    Argument('joint_states', str, 'topic of the robot', 'joint_states'),
    Argument('robot_description', str, 'topic of the robot', 'robot_description'),
    Argument('effort_topic', str, 'topic with torques, where joint_states have none'),
    Argument('params_file', str, 'parameters of the nodes; empty: config/real_robot.yaml'),
    Argument('use_sim_time', bool, 'take the time from /clock'),
    Argument('file', str, 'excitation of armid excite; empty: design one'),
    Argument('environment', str, 'what stands around the arm: YAML, MoveIt scene'),
    Argument('floor', str, 'height above the base [m], or none; empty: that of the robot'),
    Argument('duration', float, 'of an excitation that is designed [s]; empty: 44.0'),
    Argument('runs', int, 'how often it is run; the last of several is held out; empty: 2'),
    Argument('rehearse', bool, 'run it slowly first, and go on only if that is as foreseen'),
    Argument('diagnose', bool, 'look for what the model lacks, too; empty: true'),
    Argument('simulate', bool, 'have a simulated arm, with friction and noise, for a robot'),
)


def generate_launch_description():
    """Describe what is started; `ros2 launch armid_ros identify.launch.py --show-args`."""
    return described(ARGUMENTS, start)


def start(given):
    """Return the nodes."""

    def some(*names):
        return {name: given[name] for name in names if name in given}

    def one(name, chosen, usual, remapped=(), **more):
        remappings = list(dict(remapped).items())
        return node(given, name, chosen, usual, shipped=shipped, remappings=remappings, **more)

    simulate = given.get('simulate', False)
    shipped = '' if simulate else str(Path(__file__).parents[1] / 'config' / 'real_robot.yaml')
    if not simulate and not {'robot', 'params_file'} & given.keys():
        raise RuntimeError('robot is missing: give robot:=URDF, or a params_file with robot')
    unnamed = {} if simulate else {'robot': ''}  # no robot, rather than the default one
    topics = some('joint_states', 'robot_description')
    own, simulation = dict(topics), {'simulation': True} if simulate else {}
    if 'effort_topic' in given:
        topics['joint_states'] = 'joint_state_merger/joint_states'
    if 'controller' in given and not simulate:
        topics['joint_trajectory'] = f'{given["controller"]}/joint_trajectory'
    folder = Path(given.get('save_to', 'identification')).expanduser()
    live, run = {'save_to': str(folder / 'live')}, {'save_to': str(folder)}
    bag = {'bag': str(folder / 'run')}
    saved = 'save_to' in given  # in one folder, whatever the parameter file has
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
