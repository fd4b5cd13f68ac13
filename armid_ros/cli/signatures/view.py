# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording to look at, with the arm that moves."""

from __future__ import annotations

from pathlib import Path

from armid_ros.cli.signatures import columns, options
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid view run.mcap --model found --out run.rrd')
@click.argument('bag', required=False, type=click.Path(path_type=Path))
@click.option(
    '--model',
    type=click.Path(path_type=Path),
    help='A model.yaml, or the folder that identify or diagnose wrote: its torque is predicted, '
    'and joints that the diagnosis names are coloured.',
)
@options.robot_described(help='As elsewhere; of the model by default.')
@click.option('--out', type=click.Path(path_type=Path), help='File to write, .rrd; no window.')
@click.option('--mark', metavar='A,B,...', help='Joints to be coloured.')
@click.option('--live', is_flag=True, help='Show joint_states as they come; no BAG.')
@click.option('--namespace', default='', help='With --live: of the nodes, such as left_arm.')
@columns.options
@options.topic
@options.gravity
@options.joints
@options.reading
@done_by('view')
def view() -> None:
    """
    Look at a recording in rerun: the moving arm, torques, and what a model does not explain.

    With --live the arm is shown as it moves; the online identifier beside it has the predictions.

    """
