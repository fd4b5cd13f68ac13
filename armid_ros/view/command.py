# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command ``armid view``: a recording and its moving arm in rerun."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from armid_ros.cli import columns, parameters
from armid_ros.cli.terminal import say
import click


@click.command(epilog='Example: armid view run.mcap --model found --out run.rrd')
@click.argument('bag', type=click.Path(path_type=Path))
@click.option(
    '--model',
    type=parameters.ModelPath(path_type=Path),
    help='A model.yaml, or the folder that identify or diagnose wrote. The torque of the model is '
    'shown, and the joints of named effects are coloured.',
)
@parameters.robot_described(
    help='Shipped name or path of the robot; by default the robot of the model.'
)
@click.option(
    '--out',
    type=click.Path(path_type=Path),
    help='File to write (.rrd) in place of a window.',
)
@click.option(
    '--mark',
    metavar='A,B,...',
    callback=parameters.names,
    help='Joints to colour; by default the joints of named effects.',
)
@columns.options
@parameters.topic
@parameters.gravity
@parameters.joints
@parameters.reading
def view(
    bag: Path,
    model: Path | None,
    robot_source: str | None,
    gravity: str,
    joints: str | None,
    out: Path | None,
    mark: tuple[str, ...],
    topic: str | None,
) -> None:
    """Show a recording in rerun: moving arm, measured and predicted torques, and residuals."""
    from armid_ros import ArmModel
    from armid_ros.cli import options
    from armid_ros.view.rerun_log import log_recording, open_stream

    if model is None:
        arm = ArmModel(options.open_robot(robot_source or '-', gravity, joints, [bag]))
    else:
        robot = options.open_robot(robot_source, gravity, joints, [bag]) if robot_source else None
        arm = options.model_of(model, robot)
    (recording,) = options.read([bag], arm.robot, topic)
    if model is not None and not mark:  # joints of the named effects of a diagnosis
        path = model.with_name('diagnosis.json')
        if path.is_file():
            effects = json.loads(path.read_text(encoding='utf-8'))['effects']
            mark = tuple(dict.fromkeys(joint for one in effects for joint in one['joints']))
    for joint in mark:
        arm.robot.index(joint)
    name = Path(recording.source).name or arm.robot.name
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=None if out is None else out.parent) as folder:
        file = None if out is None else Path(folder) / 'run.rrd'
        stream = open_stream(name, file)
        notes = log_recording(stream, arm, recording, mark)
        stream.disconnect()
        if file is not None and out is not None:
            file.replace(out)  # the file appears when it is complete
    for note in notes:
        say(f'note: {note}')
    if out is not None:
        coloured = f', coloured: {", ".join(mark)}' if mark else ''
        samples = f'{len(recording)} samples of {arm.robot.n_joints} joints'
        say(f'{out}: {samples}{coloured}; rerun {out}')
