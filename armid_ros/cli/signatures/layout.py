# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Layouts of plotters for one robot."""

from __future__ import annotations

from armid_ros.cli.signatures import options
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid layout --robot ur10.urdf --namespace left --out layouts')
@options.robot
@options.folder
@click.option('--namespace', default='', help='Of the nodes, such as left_arm.')
@options.joints
@done_by('layout')
def layout() -> None:
    """Write layouts for PlotJuggler, Foxglove and RViz that show this robot's joints by name."""
