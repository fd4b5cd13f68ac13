# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command ``armid view``: a recording and its moving arm in rerun."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import json
from pathlib import Path

from armid_ros.cli import columns, parameters
from armid_ros.cli.terminal import say
from armid_ros.errors import OutputError
import click


@click.command(epilog='Example: armid view run.mcap --model found --out run.rrd')
@click.argument('bag', type=click.Path(path_type=Path))
@click.option(
    '--model',
    type=parameters.ModelPath(path_type=Path),
    help='A model.yaml, or the folder that identify or diagnose wrote: its torque is predicted, '
    'and joints that the diagnosis names are coloured.',
)
@parameters.robot_described(help='Shipped name or path; that of the model by default.')
@click.option('--out', type=click.Path(path_type=Path), help='File to write, .rrd; no window.')
@click.option(
    '--mark',
    metavar='A,B,...',
    callback=parameters.names,
    help='Joints to colour; default: those named.',
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
    """Show a recording in rerun: the moving arm, torques, and the residual of a model."""
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
    with _whole(out) as file:
        stream = open_stream(Path(recording.source).name or arm.robot.name, file)
        notes = log_recording(stream, arm, recording, mark)
        stream.disconnect()
    for note in notes:
        say(f'note: {note}')
    if out is not None:
        coloured = f', coloured: {", ".join(mark)}' if mark else ''
        samples = f'{len(recording)} samples of {arm.robot.n_joints} joints'
        say(f'{out}: {samples}{coloured}; rerun {out}')


@contextmanager
def _whole(out: Path | None) -> Iterator[Path | None]:
    """Yield a temporary file, and move it to its place when it is complete."""
    if out is None:
        yield None
        return
    part = out.with_name(f'.{out.name}.part')
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        part.unlink(missing_ok=True)
        part.touch(exist_ok=False)
        yield part
        part.replace(out)
    except OSError as error:
        raise OutputError(f'{out}: cannot be written: {error.strerror}') from error
    finally:
        part.unlink(missing_ok=True)
