# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identify and record a running robot, from its joint_states and robot_description."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    """Describe what is started; `ros2 launch armid_ros identify.launch.py --show-args`."""
    remappings = [
        ('joint_states', LaunchConfiguration('joint_states')),
        ('robot_description', LaunchConfiguration('robot_description')),
    ]
    gravity = ParameterValue(LaunchConfiguration('gravity'), value_type=str)
    bag = ParameterValue(LaunchConfiguration('bag'), value_type=str)
    save_to = ParameterValue(LaunchConfiguration('save_to'), value_type=str)
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'joint_states', default_value='joint_states', description='topic of the robot'
            ),
            DeclareLaunchArgument(
                'robot_description',
                default_value='robot_description',
                description='topic of the robot',
            ),
            DeclareLaunchArgument(
                'gravity', default_value='earth', description='earth, moon, or x,y,z [m/s^2]'
            ),
            DeclareLaunchArgument(
                'bag', default_value='', description='directory to record to; empty: dated'
            ),
            DeclareLaunchArgument(
                'save_to',
                default_value='online_identification',
                description='folder for what ~/save writes',
            ),
            Node(
                package='armid_ros',
                executable='online_identifier',
                parameters=[{'gravity': gravity, 'save_to': save_to}],
                remappings=remappings,
            ),
            Node(
                package='armid_ros',
                executable='recorder',
                parameters=[{'bag': bag, 'topics': ['joint_states', 'robot_description']}],
                remappings=remappings,
            ),
        ]
    )
