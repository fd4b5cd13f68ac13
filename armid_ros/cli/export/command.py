# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command ``armid export``: write an identified arm in the format of another program."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
import re

from armid_ros.cli import parameters
from armid_ros.cli.terminal import say
from armid_ros.errors import OutputError
import click
from click.core import ParameterSource

#: Kinds of load data by manufacturer, and all export kinds in the order of the help.
LOADS = ('ur', 'franka', 'kuka', 'abb')
KINDS = ('cpp', 'python', *LOADS, 'ranges', 'urdf', 'mjcf', 'sdf')
#: Export kinds that each option applies to.
_KINDS_OF = {'joint': LOADS, 'frame': LOADS, 'spread': ('ranges',)}


@click.command('export', epilog='Example: armid export found/model.yaml --to cpp --out torque.hpp')
@click.argument('model', type=parameters.ModelPath(path_type=Path))
@click.option(
    '--to',
    'kind',
    type=click.Choice(KINDS),
    required=True,
    help='Joint torque as C++ or Python; payload as load data of Universal Robots, Franka, KUKA '
    'or ABB; ranges for domain randomisation; URDF; MJCF for MuJoCo; SDF for Gazebo.',
)
@click.option(
    '--out', required=True, type=parameters.OutPath(path_type=Path), help='File to write.'
)
@parameters.robot_described(help='Shipped name or path; by default the robot of the model.')
@parameters.joints
@click.option('--joint', help='Joint that moves the payload; needed if several have one.')
@click.option(
    '--frame',
    help='Link whose frame the load data are in; by default tool0, flange, or the only link that '
    'moves with the payload.',
)
@click.option(
    '--spread',
    type=click.FloatRange(0.0, min_open=True),
    default=0.1,
    show_default=True,
    help='Prior standard deviation of masses and centres, as a share of the described value.',
)
def export(
    model: Path,
    kind: str,
    out: Path,
    robot_source: str | None,
    joints: str | None,
    joint: str | None,
    frame: str | None,
    spread: float,
) -> None:
    """Write a model for a controller, a simulator, or the load data of a manufacturer."""
    from armid_ros.cli import options
    from armid_ros.cli.export.dynamics import torque_code
    from armid_ros.cli.export.loads import load_of, load_text
    from armid_ros.cli.export.ranges import ranges_text
    from armid_ros.cli.export.sdf import arm_sdf, urdf_or_mjcf
    from armid_ros.files import write_file
    from armid_ros.identification.parameters_file import read_parameters

    context = click.get_current_context()
    for name, kinds in _KINDS_OF.items():
        typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if typed and kind not in kinds:
            raise click.UsageError(f'--{name} is only for --to {", ".join(kinds)}, not for {kind}')
    if out.exists() and model.exists() and out.samefile(model):
        raise OutputError(f'--out {out} would overwrite the model itself; name another file')
    robot = None
    if robot_source is not None:
        robot = options.open_robot(robot_source, 'earth', joints)
    elif joints is not None:
        raise click.UsageError('--joints needs --robot, the description whose joints are driven')
    arm = options.model_of(model, robot)
    notes: tuple[str, ...] = ()
    if kind in ('cpp', 'python'):
        text, left_out = torque_code(arm, kind, str(model))
        notes = _left_out('the torque', left_out)
    elif kind in LOADS:
        text, notes = load_text(load_of(arm, joint, frame), kind, str(model))
    elif kind == 'ranges':
        text = ranges_text(arm, read_parameters(model), spread, str(model))
    else:
        made = arm_sdf(arm, str(model)) if kind == 'sdf' else urdf_or_mjcf(arm, kind, str(model))
        text, left_out = made
        notes = _left_out('this file', left_out)
    with suppress(OSError):  # reported when the file is written
        out.parent.mkdir(parents=True, exist_ok=True)
    write_file(out, text)
    for note in notes:
        say(f'note: {note}')
    say(f'{out}: written')


def _left_out(where: str, lines: Sequence[str]) -> tuple[str, ...]:
    """Return a note on the parameters that an exported file cannot contain."""
    short = [
        re.sub(r'^\w+: (.+ = )(\S+)', lambda value: f'{value[1]}{float(value[2]):.2g}', line)
        for line in lines
    ]
    return (f'not in {where}: {"; ".join(short)}',) if short else ()
