# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated arm that is excited, identified online and recorded."""

from armid_ros.nodes.running.launching import Argument, described, node, SIMULATED_DRIVES

ARGUMENTS = (
    Argument('robot', str, 'shipped name, URDF or xacro; empty: humanoid_arm'),
    Argument('gravity', str, 'earth, moon, or x,y,z in the frame of the base [m/s^2]'),
    Argument('bag', str, 'directory to record to; empty: dated'),
    Argument('rate', float, 'of joint_states [Hz]; empty: 500.0'),
    Argument('duration', float, 'of the excitation [s]; empty: 44.0'),
    Argument(
        'floor', str, 'height above the origin of the base [m], or none; empty: that of the robot'
    ),
    Argument('namespace', str, 'of the nodes and of the topics'),
    Argument('params_file', str, 'parameters of the nodes'),
    Argument('use_sim_time', bool, 'take the time from /clock'),
)


def generate_launch_description():
    """Describe what is started; `ros2 launch armid_ros simulation.launch.py --show-args`."""
    return described(ARGUMENTS, start)


def start(given):
    """Return the nodes."""

    def some(*names):
        return {name: given[name] for name in names if name in given}

    topics = ['joint_states', 'robot_description', 'joint_trajectory']
    excitation = some('robot', 'gravity', 'duration', 'floor')
    return [
        node(given, 'simulated_arm', some('robot', 'gravity', 'rate'), SIMULATED_DRIVES),
        node(given, 'online_identifier', some('gravity'), {}),
        node(given, 'recorder', some('bag'), {'topics': topics}),
        node(given, 'excitation_publisher', excitation, {'simulation': True}),
    ]
