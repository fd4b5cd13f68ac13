# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Entry point of the executables of all nodes, with install instructions if ROS 2 is missing."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
import re
import sys

from armid_ros.plug_ins import load_plug_in, plug_ins

#: Modules of ROS 2 that the nodes import.
_ROS = re.compile(r'rclpy|ros\w+_runtime_py|\w+_(msgs|interfaces|srvs)')


def main(name: str | None = None) -> int | None:
    """Run a node of this package or a plug-in; the default name is that of the program."""
    name = name or Path(sys.argv[0]).name
    try:
        if find_spec(f'armid_ros.nodes.{name}') is None and name in plug_ins('nodes'):
            node = load_plug_in(plug_ins('nodes')[name])
        else:
            node = import_module(f'armid_ros.nodes.{name}')
    except ModuleNotFoundError as error:
        remedy = install_hint(error)
        if remedy is None:
            raise
        print(f'{name}: {remedy}', file=sys.stderr)
        raise SystemExit(2) from None
    code: int | None = node.main()
    return code


def install_hint(error: ModuleNotFoundError) -> str | None:
    """Return a message on how to install a missing ROS 2 module; None for other modules."""
    module = (error.name or '').partition('.')[0]
    if module == 'armid_msgs':
        return (
            'the message package armid_msgs is missing; it has to be compiled: run `make` in a '
            'clone, or pip install --no-build-isolation ./msg_schemas, or `colcon build`'
        )
    if _ROS.fullmatch(module):
        return (
            f'{module} is missing: nodes need ROS 2 Jazzy. `make` in a clone sets it up, '
            "pip install 'armid_ros[ros]' installs it from wheels, or source a Jazzy workspace"
        )
    return None
