# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Identify an arm from the excitation to the report, and end.

THE ARM MOVES: `ros2 launch armid_ros identify.launch.py robot:=my_arm.urdf` begins as soon as a
controller and joint states are there. `simulate:=true` tries it on a simulated arm first.

"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

#: The simulated arm of `simulate:=true`.
DRIVES = {
    'rate': 500.0,
    'torque_noise': [0.05],
    'effects': [
        'viscous_friction:viscous_coefficient=0.5',
        'coulomb_friction:coulomb_torque=0.2',
    ],
}
#: Name, default and description of every argument; without a default it has to be given.
ARGUMENTS = (
    ('robot', None, 'shipped name, URDF or xacro'),
    ('gravity', 'earth', 'earth, moon, or x,y,z in the frame of the base [m/s^2]'),
    ('joints', '', 'driven joints, with commas; empty: all but those of grippers'),
    ('effects', '', 'beside the rigid body, with commas; empty: usual friction and offset'),
    ('save_to', 'identification', 'folder for recordings, model and reports'),
    ('namespace', '', 'of the nodes and of the topics of the robot'),
    (
        'controller',
        'joint_trajectory_controller',
        'of its topic and action; empty: neither',
    ),
    ('joint_states', 'joint_states', 'topic of the robot'),
    ('robot_description', 'robot_description', 'topic of the robot'),
    ('effort_topic', '', 'topic with torques, where joint_states have none'),
    ('params_file', '', 'parameters of the nodes; empty: those of config/real_robot.yaml'),
    ('use_sim_time', 'false', 'take the time from /clock'),
    ('file', '', 'excitation of armid excite; empty: design one'),
    ('environment', '', 'what stands around the arm: YAML, MoveIt scene'),
    ('floor', '', 'height above the origin of the base [m], or none; empty: that of the robot'),
    ('duration', '44.0', 'of an excitation that is designed [s]'),
    ('runs', '2', 'how often it is run; the last of several is held out'),
    ('rehearse', 'false', 'run it slowly first, and go on only if that is as foreseen'),
    ('diagnose', 'true', 'look for what the model lacks, too'),
    ('simulate', 'false', 'have a simulated arm, with friction and noise, in place of a robot'),
)


def generate_launch_description():
    """Describe what is started; `ros2 launch armid_ros identify.launch.py --show-args`."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, default, text in ARGUMENTS
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])


def start(context):
    """Return the nodes, with what the arguments say on top of the parameter file."""
    said = {name: LaunchConfiguration(name).perform(context) for name, _, _ in ARGUMENTS}
    told = {name: text.lower() == 'true' for name, text in said.items()}
    folder = Path(said['save_to']).expanduser()
    topics = {name: said[name] for name in ('joint_states', 'robot_description')}
    if said['effort_topic']:
        topics['joint_states'] = 'joint_state_merger/joint_states'
    if said['controller'] and not told['simulate']:
        topics['joint_trajectory'] = f'{said["controller"]}/joint_trajectory'
    arm = {**texts(said, 'robot', 'gravity'), **lists(said, 'joints')}
    effects = lists(said, 'effects')
    excitation = texts(said, 'file', 'environment', 'floor') | {
        'duration': float(said['duration']),
        'start': False,
        'simulation': told['simulate'],
    }
    live = {'save_to': ParameterValue(str(folder / 'live'), value_type=str)}
    run = {
        'save_to': ParameterValue(str(folder), value_type=str),
        'runs': int(said['runs']),
        'rehearse': told['rehearse'],
        'diagnose': told['diagnose'],
    }
    bag = {
        'bag': ParameterValue(str(folder / 'run'), value_type=str),
        'record': False,
        'topics': list(topics.values()),
    }
    nodes = [
        node(said, 'excitation_publisher', {**arm, **effects, **excitation}, topics),
        node(said, 'online_identifier', {**arm, **effects, **live}, topics),
        node(said, 'recorder', bag, {}),
        node(said, 'identification_run', {**arm, **effects, **run}, {}, on_exit=Shutdown()),
    ]
    if said['effort_topic']:
        own = {name: said[name] for name in ('joint_states', 'robot_description')}
        torque = {**texts(said, 'effort_topic'), **lists(said, 'joints')}
        nodes.append(node(said, 'joint_state_merger', torque, own))
    if told['simulate']:
        drives = {**texts(said, 'robot', 'gravity'), **DRIVES}
        nodes.append(node(said, 'simulated_arm', drives, topics))
    return nodes


def node(said, name, parameters, topics, **more):
    """Return a node in the namespace, with parameters on top of those of the file."""
    file = said['params_file']
    if not file and said['simulate'].lower() != 'true':
        file = str(Path(__file__).parents[1] / 'config' / 'real_robot.yaml')
    clock = {'use_sim_time': said['use_sim_time'].lower() == 'true'}
    return Node(
        package='armid_ros',
        executable=name,
        namespace=said['namespace'],
        parameters=[*([file] if file else []), clock, parameters],
        remappings=list(topics.items()),
        output='screen',
        **more,
    )


def texts(said, *names):
    """Return parameters that are texts, whatever they look like."""
    return {name: ParameterValue(said[name], value_type=str) for name in names}


def lists(said, name):
    """Return a parameter that is a list of names, where there are any."""
    values = [value.strip() for value in said[name].split(',') if value.strip()]
    return {name: values} if values else {}
