# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command ``armid positions``: drives, friction and tool, identified without torque."""

from __future__ import annotations

from itertools import compress
import json
from pathlib import Path
from typing import TYPE_CHECKING

from armid_ros.cli import columns, parameters
from armid_ros.cli.terminal import progress
import click

if TYPE_CHECKING:
    from armid_ros import Robot
    from armid_ros.motion import FloatArray


@click.command(
    epilog='Example: armid positions run.mcap --robot ur5.urdf --gains 800,40 --out drives'
)
@parameters.bags
@parameters.robot
@parameters.folder
@click.option(
    '--gains',
    metavar='KP,KD',
    help='Known gains of the position control [N m/rad, N m s/rad], of all joints; or KP of each '
    'joint and then KD of each joint; or positions.json of an earlier fit. Fitted by default.',
)
@click.option(
    '--commands',
    'commanded',
    metavar='TOPIC',
    help='Topic of the commanded positions: JointState, or the state of a '
    'joint_trajectory_controller. Of a table the columns, written as for --position.',
)
@click.option(
    '--gravity-compensation',
    'compensated',
    is_flag=True,
    help='The controller adds the gravity torque of the described robot.',
)
@columns.recordings
def positions(
    bags: tuple[Path, ...],
    robot_source: str,
    gravity: str,
    joints: str | None,
    topic: str | None,
    out: Path,
    gains: str | None,
    commanded: str | None,
    compensated: bool,
    seed: int,
    as_json: bool,
) -> None:
    """
    Find delay, gains, friction, rotor inertia and tool from commanded and measured positions.

    The control is tau = kp (u - q) + kd (du - dq) with a delayed command u; du is 0 without
    commanded velocities. The described links are taken as exact. Without commanded velocities,
    viscous friction needs --gains. model.yaml has the effects; positions.json also has delay and
    gains. The folder torque has each recording with the torque of the control, for armid identify
    and armid diagnose.

    """
    from armid_ros import save_model
    from armid_ros.cli import options
    from armid_ros.estimate import Estimate
    from armid_ros.positions.commands import read_commands
    from armid_ros.positions.fit import fit_positions
    from armid_ros.positions.loop import LoopModel
    from armid_ros.positions.text import fit_document, fit_summary, limit_hints, SCHEMA
    from armid_ros.recording import write_recording
    import numpy as np

    staged = options.stage(out, SCHEMA, robot_source)
    robot = options.open_robot(robot_source, gravity, joints, bags)
    known = gains_of(gains, robot) if gains else None
    with progress('reading') as tick:
        recordings = options.read(bags, robot, topic)
        options.tell_damage(*recordings)
        how = columns.settings(), options.read_settings()
        runs = [
            (one, read_commands(path, robot, one, commanded, *how))
            for path, one in zip(bags, recordings, strict=True)
        ]
        tick(0.1, 'fitting')
        model = LoopModel(robot, compensated)
        found = fit_positions(model, runs, known)
    torques = [model.with_torque(found.values, *run) for run in runs]
    for k, one in enumerate(torques):
        write_recording(staged.folder / 'torque' / f'{k + 1}_{bags[k].stem}', one)
    source = options.kept_source(robot_source, robot, staged.folder)
    sure = np.isfinite(found.std)
    names = tuple(compress(found.parameters, sure))
    estimate = Estimate(names, found.values[sure], np.diag(found.std[sure] ** 2))
    save_model(staged.folder / 'model.yaml', found.arm, source, estimate)
    document = fit_document(found, limit_hints(runs, torques, robot))
    step = f'armid identify {out}/torque/* --robot {robot_source} --out model'
    summary = None if as_json else fit_summary(found, document, step)
    options.deliver_document(staged, 'positions', document, summary, 'model.yaml', 'torque')


def gains_of(text: str, robot: Robot) -> FloatArray:
    """Parse the option --gains; return kp [N m/rad] and kd [N m s/rad] of n joints, (2, n)."""
    from armid_ros.errors import RobotError
    from armid_ros.files import reading
    from armid_ros.files.regular import read_text
    from armid_ros.recording.columns import numbers
    import numpy as np

    with reading('--gains', RobotError):
        if text.endswith('.json'):
            rows = json.loads(read_text(text, RobotError))['quantities']
            gains = [row['value'] for row in rows if row['name'].endswith('_gain')]
            values = np.array(gains)
        else:
            values = np.array(numbers(text))
    if len(values) not in (2, 2 * robot.n_joints) or np.any(values < 0.0) or not values[0]:
        raise RobotError(
            f"--gains '{text}' is not valid; give KP,KD, or {robot.n_joints} values of KP and "
            f'then {robot.n_joints} of KD, without negative values and with a positive first KP'
        )
    return np.asarray(np.broadcast_to(values.reshape(2, -1), (2, robot.n_joints)))
