# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A double of launch and launch_ros, which have no wheel: what the launch files use of them.

Each rule names its file: actions/declare_launch_argument.py and actions/opaque_function.py of
ros2/launch; utilities/normalize_parameters.py, utilities/evaluate_parameters.py and
actions/node.py of ros2/launch_ros.

"""

from pathlib import Path
import runpy
import sys
from types import ModuleType, SimpleNamespace
from unittest.mock import patch

import yaml

LAUNCH = Path(__file__).parents[2] / 'launch'


class DeclareLaunchArgument:
    """An argument with its default."""

    def __init__(self, name, *, default_value=None, description):
        self.name, self.default_value, self.description = name, default_value, description

    def execute(self, context):
        """Set the default where nothing is given; declare_launch_argument.py, execute."""
        if self.name not in context:
            if self.default_value is None:
                raise RuntimeError(f'Required launch argument "{self.name}" was not provided')
            context[self.name] = self.default_value


class LaunchConfiguration:
    """The value of an argument, in a context that is a mapping."""

    def __init__(self, name):
        self._name = name

    def perform(self, context):
        """Return the text."""
        return context[self._name]


class OpaqueFunction:
    """A function that returns actions."""

    def __init__(self, *, function):
        self._function = function

    def execute(self, context):
        """Return the actions; opaque_function.py, execute."""
        return self._function(context)


class Node:
    """A process of a node."""

    def __init__(
        self,
        *,
        package,
        executable,
        name,
        namespace,
        parameters,
        ros_arguments=(),
        remappings=(),
        output='log',
        on_exit=None,
    ):
        self.package, self.executable, self.name = package, executable, name
        self.namespace, self.remappings = '/' + namespace.strip('/'), list(remappings)
        self.parameters, self.on_exit = [evaluated(p) for p in parameters], on_exit
        self.ros_arguments = list(ros_arguments)
        pairs = [word.split(':=', 1) for word in self.ros_arguments[1::2]]
        self.defaults = {key: yaml.safe_load(text) for key, text in pairs}
        self.execute = lambda context: []

    def arguments(self, folder):
        """Write the parameter files, and return the ROS arguments in order; node.py, execute."""
        words = ['--ros-args', '-r', f'__node:={self.name}', '-r', f'__ns:={self.namespace}']
        for number, given in enumerate(self.parameters):
            if isinstance(given, dict):
                # node.py, _create_params_file_from_dict: the full name, as both parts are given
                full = f'{self.namespace.rstrip("/")}/{self.name}'
                given = _written(folder / f'{self.name}_{number}.yaml', full, given)
            words += ['--params-file', str(given)]
        for pair in self.remappings:
            words += ['-r', ':='.join(pair)]
        return ['--ros-args', *self.ros_arguments, *words]  # node.py, __init__


def evaluated(given):
    """Return parameters as launch_ros has them; evaluate_parameters.py and normalize_...py."""
    if isinstance(given, str):
        return given
    for name, value in given.items():
        assert isinstance(name, str)
        items = value if isinstance(value, list) else [value]
        # an empty list has no type, and items of different types are no parameter
        if not items or len({type(item) for item in items}) > 1:
            raise TypeError(f'{name}: {value!r}')
        assert isinstance(items[0], bool | int | float | str), (name, value)
    return given


def modules():
    """Return the modules that a launch file imports."""
    content = {
        'launch': {'LaunchDescription': list},
        'launch.actions': {
            'DeclareLaunchArgument': DeclareLaunchArgument,
            'OpaqueFunction': OpaqueFunction,
            'Shutdown': SimpleNamespace,
        },
        'launch.substitutions': {'LaunchConfiguration': LaunchConfiguration},
        'launch_ros': {},
        'launch_ros.actions': {'Node': Node},
    }
    found = {name: ModuleType(name) for name in content}
    for name, module in found.items():
        vars(module).update(content[name])
    return found


def described(name):
    """Return what a launch file describes."""
    return runpy.run_path(str(LAUNCH / f'{name}.launch.py'))['generate_launch_description']()


def declared(name):
    """Return the declared arguments of a launch file."""
    with patch.dict(sys.modules, modules()):
        return [one for one in described(name) if isinstance(one, DeclareLaunchArgument)]


def launched(name, **arguments):
    """Return the nodes that a launch file starts, by executable."""
    assert arguments.keys() <= {one.name for one in declared(name)}
    context = dict(arguments)
    with patch.dict(sys.modules, modules()):
        found = [node for one in described(name) for node in one.execute(context) or ()]
    return {node.executable: node for node in found}


def _written(file, name, parameters):
    file.write_text(yaml.safe_dump({name: {'ros__parameters': parameters}}))
    return file
