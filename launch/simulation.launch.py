# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulate an arm, excite it, identify it online and record it."""

from armid_ros.nodes.running.launching import Argument, described, node, SIMULATED_DRIVES

ARGUMENTS = (
    Argument('robot', str, 'shipped robot, URDF or xacro; empty: humanoid_arm'),
    Argument('gravity', str, 'earth, moon, or x,y,z in the base frame [m/s^2]'),
    Argument('bag', str, 'directory of the recorded bag; empty: armid_<date>_<time>'),
    Argument('rate', float, 'rate of joint_states [Hz]; empty: 500.0'),
    Argument('duration', float, 'duration of the excitation [s]; empty: 44.0'),
    Argument(
        'floor', str, 'height of the floor above the base [m], or none; empty: that of the robot'
    ),
    Argument('namespace', str, 'namespace of the nodes and of the topics'),
    Argument('params_file', str, 'parameter file of the nodes'),
    Argument('use_sim_time', bool, 'take the time from /clock'),
)


def generate_launch_description():
    """Return the launch description; `ros2 launch ... --show-args` lists its arguments."""
    return described(ARGUMENTS, start)


def start(given):
    """Return the launch actions of the nodes for the given arguments."""

    def some(*names):
        """Return the given arguments of some names."""
        return {name: given[name] for name in names if name in given}

    topics = ['joint_states', 'robot_description', 'joint_trajectory']
    excitation = some('robot', 'gravity', 'duration', 'floor')
    return [
        node(given, 'simulated_arm', some('robot', 'gravity', 'rate'), SIMULATED_DRIVES),
        node(given, 'online_identifier', some('gravity'), {}),
        node(given, 'recorder', some('bag'), {'topics': topics}),
        node(given, 'excitation_publisher', excitation, {'simulation': True}),
    ]
