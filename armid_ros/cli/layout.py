# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid layout`: window layouts of plotting tools for one robot."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli import parameters
from armid_ros.cli.terminal import say
import click


@click.command(epilog='Example: armid layout --robot ur10.urdf --namespace left --out layouts')
@parameters.robot
@parameters.folder
@click.option('--namespace', default='', help='Namespace of the nodes, as left_arm.')
@parameters.joints
def layout(robot_source: str, out: Path, namespace: str, joints: str | None) -> None:
    """Write layouts of PlotJuggler, Foxglove and RViz with the joints of a robot."""
    from armid_ros.cli import options
    from armid_ros.files import write_file
    from armid_ros.report.layouts import plotter_layouts, SCHEMA

    staged = options.stage(out, SCHEMA)
    robot = options.open_robot(robot_source, 'earth', joints)
    files = plotter_layouts(robot.name, robot.joints, namespace, robot.base)
    for name, text in files.items():
        write_file(staged.folder / name, text)
    staged.keep()
    say(f'{out}: {", ".join(files)}')
