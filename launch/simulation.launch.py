# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated arm that is excited, identified online and recorded."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    """Describe what is started; `ros2 launch armid_ros simulation.launch.py --show-args`."""
    robot = ParameterValue(LaunchConfiguration('robot'), value_type=str)
    gravity = ParameterValue(LaunchConfiguration('gravity'), value_type=str)
    bag = ParameterValue(LaunchConfiguration('bag'), value_type=str)
    rate = ParameterValue(LaunchConfiguration('rate'), value_type=float)
    duration = ParameterValue(LaunchConfiguration('duration'), value_type=float)
    floor = ParameterValue(LaunchConfiguration('floor'), value_type=str)
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'robot', default_value='humanoid_arm', description='shipped name, URDF or xacro'
            ),
            DeclareLaunchArgument(
                'gravity', default_value='earth', description='earth, moon, or x,y,z [m/s^2]'
            ),
            DeclareLaunchArgument(
                'bag', default_value='', description='directory to record to; empty: dated'
            ),
            DeclareLaunchArgument(
                'rate', default_value='500.0', description='of joint_states [Hz]'
            ),
            DeclareLaunchArgument(
                'duration', default_value='44.0', description='of the excitation [s]'
            ),
            DeclareLaunchArgument(
                'floor',
                default_value='',
                description='height above the origin of the base [m], or none; empty: that of '
                'the robot',
            ),
            Node(
                package='armid_ros',
                executable='simulated_arm',
                parameters=[
                    {
                        'robot': robot,
                        'gravity': gravity,
                        'rate': rate,
                        'torque_noise': [0.05],
                        'effects': [
                            'viscous_friction:viscous_coefficient=0.5',
                            'coulomb_friction:coulomb_torque=0.2',
                        ],
                    }
                ],
            ),
            Node(
                package='armid_ros',
                executable='online_identifier',
                parameters=[{'gravity': gravity}],
            ),
            Node(
                package='armid_ros',
                executable='recorder',
                parameters=[
                    {
                        'bag': bag,
                        'topics': ['joint_states', 'robot_description', 'joint_trajectory'],
                    }
                ],
            ),
            Node(
                package='armid_ros',
                executable='excitation_publisher',
                parameters=[
                    {
                        'simulation': True,
                        'robot': robot,
                        'gravity': gravity,
                        'duration': duration,
                        'floor': floor,
                    }
                ],
            ),
        ]
    )
