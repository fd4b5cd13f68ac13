# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Launch descriptions with optional arguments, and the nodes that they start."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import json
from typing import Any, NamedTuple

from armid_ros.files.cells import listed

#: Default parameters of the simulated arm in launch files.
SIMULATED_DRIVES: Mapping[str, Any] = {
    'rate': 500.0,
    'torque_noise': [0.05],
    'effects': [
        'viscous_friction:viscous_coefficient=0.5',
        'coulomb_friction:coulomb_torque=0.2',
    ],
}


class Argument(NamedTuple):
    """
    Argument of a launch file, with its type and default.

    Attributes
    ----------
    name, description : str
        Name, and description in `ros2 launch --show-args`.
    kind : type
        str, bool, int, float, or list for names separated by commas.
    default : str or None
        Default text; empty if parameter files and nodes decide. None: the argument is required.

    """

    name: str
    kind: type
    description: str
    default: str | None = ''

    def read(self, text: str) -> Any:
        """Convert a text to the type of the argument; RuntimeError for an invalid text."""
        try:
            if self.kind is list:
                return [part.strip() for part in listed(text) if part.strip()]
            if self.kind is bool:
                return {'true': True, 'false': False}[text.lower()]
            return self.kind(text)
        except (KeyError, ValueError):
            kind = self.kind.__name__
            raise RuntimeError(
                f"the launch argument {self.name}:={text} is not of type '{kind}'"
            ) from None


def described(
    arguments: Sequence[Argument], start: Callable[[dict[str, Any]], Sequence[Any]]
) -> Any:
    """
    Return a launch description whose actions depend on the launch arguments.

    Parameters
    ----------
    arguments : sequence of Argument
        Arguments of `ros2 launch`.
    start : callable
        Function from the values of the arguments that are not empty to the launch actions.

    """
    from launch import LaunchDescription
    from launch.actions import DeclareLaunchArgument, OpaqueFunction
    from launch.substitutions import LaunchConfiguration

    def begin(context: Any) -> Sequence[Any]:
        texts = {a: LaunchConfiguration(a.name).perform(context) for a in arguments}
        return start({a.name: a.read(text) for a, text in texts.items() if text})

    declared = [
        DeclareLaunchArgument(a.name, default_value=a.default, description=a.description)
        for a in arguments
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=begin)])


def node(
    given: Mapping[str, Any],
    executable: str,
    chosen: Mapping[str, Any],
    usual: Mapping[str, Any],
    *,
    shipped: str = '',
    **more: Any,
) -> Any:
    """
    Return a launch action that starts a node of this package.

    Parameters
    ----------
    given : mapping
        Values of the arguments; only namespace, params_file and use_sim_time are used.
    executable : str
        Name of executable and node.
    chosen : mapping
        Parameters set by arguments; they override the parameter file.
    usual : mapping
        Parameters that are used if neither an argument nor the parameter file sets them.
    shipped : str
        Parameter file that is used if none is given.

    """
    from launch_ros.actions import Node

    file = given.get('params_file', shipped)
    defaults = {'end_with_parent': True, **usual}
    clock = {k: given[k] for k in ('use_sim_time',) if k in given}
    # Of two matching patterns in arguments and parameter files, the later one takes precedence.
    # ROS arguments, with the pattern /**, come before the files. With name and namespace given,
    # launch writes the values under the full name as the last pattern.
    return Node(
        package='armid_ros',
        executable=executable,
        name=executable,
        namespace=given.get('namespace', ''),
        ros_arguments=[
            word for k, x in defaults.items() for word in ('-p', f'{k}:={json.dumps(x)}')
        ],
        parameters=[*filter(None, (file, clock | dict(chosen)))],
        output='screen',
        **more,
    )
