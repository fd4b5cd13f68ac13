# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Play a bag, identify the recorded arm online, save the estimate, and end with the bag."""

from armid_ros.nodes.running.launching import Argument, described, node
from launch.actions import Shutdown

ARGUMENTS = (
    Argument('bag', str, 'rosbag2 directory, .mcap or .db3 file', None),
    Argument('robot', str, 'shipped robot, URDF or xacro; empty: robot_description in the bag'),
    Argument('gravity', str, 'earth, moon, or x,y,z in the base frame [m/s^2]'),
    Argument('rate', float, 'bag time per real time'),
    Argument('save_to', str, 'folder for the estimate; empty: online_identification'),
    Argument('namespace', str, 'namespace of the nodes and of the recorded topics of the robot'),
    Argument('params_file', str, 'parameter file of the nodes'),
    Argument('use_sim_time', bool, 'follow /clock; empty: publish it from the bag'),
)


def generate_launch_description():
    """Return the launch description; `ros2 launch ... --show-args` lists its arguments."""
    return described(ARGUMENTS, start)


def start(given):
    """Return the launch actions of the nodes for the given arguments."""
    play = {name: given[name] for name in ('bag', 'rate') if name in given}
    identify = {name: given[name] for name in ('robot', 'gravity', 'save_to') if name in given}
    clock = {} if 'use_sim_time' in given else {'clock_rate': 100.0}
    usual = {'use_sim_time': True, 'save_to': 'online_identification'}
    return [
        node(given, 'bag_player', play, clock, on_exit=Shutdown()),
        node(given, 'online_identifier', identify, usual),
    ]
