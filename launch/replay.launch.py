# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify online what a bag holds."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    """Describe what is started; `ros2 launch armid_ros replay.launch.py --show-args`."""
    bag = ParameterValue(LaunchConfiguration('bag'), value_type=str)
    robot = ParameterValue(LaunchConfiguration('robot'), value_type=str)
    gravity = ParameterValue(LaunchConfiguration('gravity'), value_type=str)
    rate = ParameterValue(LaunchConfiguration('rate'), value_type=float)
    return LaunchDescription(
        [
            DeclareLaunchArgument('bag', description='rosbag2 directory, .mcap or .db3 file'),
            DeclareLaunchArgument(
                'robot',
                default_value='',
                description='shipped name, URDF or xacro; empty: robot_description in the bag',
            ),
            DeclareLaunchArgument(
                'gravity', default_value='earth', description='earth, moon, or x,y,z [m/s^2]'
            ),
            DeclareLaunchArgument(
                'rate', default_value='1.0', description='bag time per real time'
            ),
            Node(
                package='armid_ros',
                executable='bag_player',
                parameters=[{'bag': bag, 'rate': rate, 'clock_rate': 100.0}],
            ),
            Node(
                package='armid_ros',
                executable='online_identifier',
                parameters=[{'robot': robot, 'gravity': gravity, 'use_sim_time': True}],
            ),
        ]
    )
