# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`armid`: one function a command; what computes is in the packages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import json
from pathlib import Path
import sys
from typing import Any

from armid_ros import __version__
from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.effects import CATALOGUE, make_effect, parse_effect
from armid_ros.errors import ArmidError, IdentificationError
from armid_ros.recording import read_recording, read_robot_description, Recording
from armid_ros.robots import load_robot, Robot, robot_from_urdf, shipped_robots
import click
import numpy as np
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TimeElapsedColumn
from rich.table import Table

DEFAULT_EFFECTS = 'viscous_friction,coulomb_friction,torque_offset'

_robot = click.option(
    '--robot',
    'robot_source',
    required=True,
    metavar='R',
    help='Shipped name, path of a URDF or xacro, or - for the /robot_description in the bag.',
)
_gravity = click.option(
    '--gravity', default='earth', show_default=True, help='earth, moon, or a vector x,y,z [m/s^2].'
)
_joints = click.option(
    '--joints', default=None, metavar='A,B,...', help='Driven joints; all movable ones by default.'
)
_out = click.option(
    '--out',
    required=True,
    type=click.Path(file_okay=False, path_type=Path),
    help='Folder to fill.',
)
_seed = click.option('--seed', default=0, show_default=True, help='Of every random number.')
_json = click.option('--json', 'as_json', is_flag=True, help='Print the result as JSON.')


class _Commands(click.Group):
    """Reports bad input as one line on stderr and exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except ArmidError as error:
            click.echo(f'armid: {error}', err=True)
            sys.exit(2)


@click.group(cls=_Commands, context_settings={'help_option_names': ['-h', '--help']})
@click.version_option(__version__, prog_name='armid')
def main() -> None:
    """Identify a robot arm: excite, record, identify, and find what the model lacks."""


@main.command(epilog='Example: armid robots')
@_json
def robots(as_json: bool) -> None:
    """List the robots that are shipped."""
    _print_table(('name', 'what it is'), list(shipped_robots().items()), as_json)


@main.command(epilog='Example: armid effects --json')
@_json
def effects(as_json: bool) -> None:
    """List the effects that can be simulated and estimated."""
    rows = [
        (name, effect.summary, ', '.join(f'{q.name} [{q.unit}]' for q in effect.quantities))
        for name, effect in CATALOGUE.items()
    ]
    _print_table(('name', 'what it is', 'parameters'), rows, as_json)


@main.command(epilog='Example: armid identify run.mcap --robot ur10.urdf --out result')
@click.argument('bags', nargs=-1, required=True, type=click.Path(path_type=Path))
@_robot
@_out
@click.option('--validate', multiple=True, type=click.Path(path_type=Path), metavar='BAG')
@click.option('--effects', 'names', default=DEFAULT_EFFECTS, show_default=True)
@click.option('--method', type=click.Choice(['ols', 'wls', 'irls']), default='wls')
@click.option('--cutoff', type=float, default=None, help='Of the position filter [Hz].')
@click.option('--decimation', type=int, default=None, help='Keep one sample of this many.')
@click.option('--quasi-static', is_flag=True, help='Weight and effects only: for slow motions.')
@click.option('--topic', default=None, help='JointState topic, where a bag has several.')
@_gravity
@_joints
@_seed
@_json
def identify(
    bags: tuple[Path, ...],
    robot_source: str,
    out: Path,
    validate: tuple[Path, ...],
    names: str,
    method: str,
    cutoff: float | None,
    decimation: int | None,
    quasi_static: bool,
    topic: str | None,
    gravity: str,
    joints: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """Fit a model with uncertainties to recordings."""
    from armid_ros import identification as ident

    robot = _load_robot(robot_source, gravity, joints, bags)
    arm = ArmModel(robot, quasi_static=quasi_static)
    for name in filter(None, names.split(',')):
        arm = arm.with_effect(make_effect(name, robot))
    settings = ident.IdentificationSettings(
        method=method,  # type: ignore[arg-type]  # click checked it
        signals=ident.SignalSettings(cutoff, decimation),
    )
    with _progress('reading') as tick:
        recordings = _read(bags, robot, topic)
        held_out = _read(validate, robot, topic)
        tick(0.0, 'identifying')
        result = ident.identify(
            arm, recordings, settings, rng=np.random.default_rng(seed), progress=tick
        )
    validation = {r.source: result.predict([r]) for r in held_out}
    document = ident.identification_document(result, robot_source, validation)
    out.mkdir(parents=True, exist_ok=True)
    if robot_source == '-':
        robot_source = 'robot.urdf'
        (out / robot_source).write_text(robot.urdf, encoding='utf-8')
    elif Path(robot_source).is_file():
        robot_source = str(Path(robot_source).resolve())
    save_model(out / 'model.yaml', result.arm, robot_source, result.estimate)
    (out / 'identification.json').write_text(json.dumps(document, indent=1), encoding='utf-8')
    if as_json:
        click.echo(json.dumps(document))
        return
    for recording in (*recordings, *held_out):
        _say(f'{recording.source}: {recording.report.describe()}')
    _print_parameters(document['parameters'])
    for note in result.notes:
        _say(f'Note: {note}.')
    train = document['training']['relative_error_percent']
    _say(f'relative error {train:.2f} % on the data it was fitted to')
    for entry in document['validation']:
        _say(f'relative error {entry["relative_error_percent"]:.2f} % on {entry["bag"]}')
    _say(f'{out}: model.yaml, identification.json')


@main.command(epilog='Example: armid simulate --robot humanoid_arm --gravity moon --out run')
@_robot
@click.option('--out', required=True, type=click.Path(path_type=Path), help='Bag to write.')
@click.option(
    '--effect',
    'texts',
    multiple=True,
    metavar='NAME:k=v',
    help='Such as viscous_friction:viscous_coefficient=0.1 or payload@wrist:payload_m=0.3.',
)
@click.option('--model', 'model_path', type=click.Path(path_type=Path), help='A model.yaml.')
@click.option('--trajectory', type=click.Path(path_type=Path), help='YAML or CSV of armid excite.')
@click.option('--rate', default=1000.0, show_default=True, help='Recorded samples per second.')
@click.option('--torque-noise', default=0.0, help='Standard deviation [N m].')
@click.option('--position-noise', default=0.0, help='Standard deviation [rad].')
@click.option('--resolution', default=0.0, help='Step of the encoders [rad].')
@_gravity
@_joints
@_seed
def simulate(
    robot_source: str,
    out: Path,
    texts: tuple[str, ...],
    model_path: Path | None,
    trajectory: Path | None,
    rate: float,
    torque_noise: float,
    position_noise: float,
    resolution: float,
    gravity: str,
    joints: str | None,
    seed: int,
) -> None:
    """Let a simulated arm follow a trajectory and record it."""
    from armid_ros.excitation import load_excitation
    from armid_ros.recording import write_recording
    from armid_ros.simulation import Sensors
    from armid_ros.simulation import simulate as run

    rng = np.random.default_rng(seed)
    robot = _load_robot(robot_source, gravity, joints, ())
    arm = load_model(model_path, robot) if model_path else ArmModel(robot)
    for text in texts:
        arm = arm.with_effect(*parse_effect(text, robot))
    excitation = load_excitation(trajectory) if trajectory else _quick_excitation(arm, rng)
    sensors = Sensors(
        torque_noise=torque_noise, position_noise=position_noise, resolution=resolution
    )
    with _progress('simulating') as tick:
        measured = run(
            arm, excitation.motion(1000.0), rng=rng, sensors=sensors, rate=rate, progress=tick
        )
    write_recording(out, measured, robot_description=robot.urdf)
    _say(f'{out}: {len(measured.t)} samples of {robot.n_joints} joints')


@main.command(epilog='Example: armid recover crashed/crashed_0.mcap --out whole')
@click.argument('file', type=click.Path(path_type=Path))
@click.option('--out', required=True, type=click.Path(path_type=Path), help='Bag to write.')
def recover(file: Path, out: Path) -> None:
    """Make a recording whole whose writer was killed."""
    from armid_ros.recording import recover as run

    _say(run(file, out).describe())


def _load_robot(source: str, gravity: str, joints: str | None, bags: Sequence[Path]) -> Robot:
    chosen = tuple(joints.split(',')) if joints else None
    if source != '-':
        return load_robot(source, gravity=gravity, joints=chosen)
    for bag in bags:
        text = read_robot_description(bag)
        if text is not None:
            return robot_from_urdf(text, gravity=gravity, joints=chosen, source=str(bag))
    raise IdentificationError(
        f'no /robot_description in {", ".join(map(str, bags)) or "any bag"}; '
        'give the URDF with --robot'
    )


def _read(bags: Sequence[Path], robot: Robot, topic: str | None) -> list[Recording]:
    return [read_recording(bag, joints=robot.joints, topic=topic) for bag in bags]


def _quick_excitation(arm: ArmModel, rng: np.random.Generator) -> Any:
    from armid_ros.excitation import design, DesignSettings
    from armid_ros.robots import collision_model

    settings = DesignSettings(period=10.0, starts=1, candidates=10)
    return design(arm, settings, rng, collision=collision_model(arm.robot)).excitation


@contextmanager
def _progress(what: str) -> Iterator[Any]:
    """Show a bar on stderr; yields tick(share, what=None)."""
    console = Console(stderr=True)
    bar = Progress(
        SpinnerColumn(),
        *Progress.get_default_columns(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
    with bar:
        task = bar.add_task(what, total=1.0)

        def tick(share: float, now: str | None = None) -> None:
            bar.update(task, completed=share, description=now or None)

        yield tick


def _print_table(heads: Sequence[str], rows: Sequence[Sequence[str]], as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps([dict(zip(heads, row, strict=True)) for row in rows], indent=1))
        return
    table = Table(*heads, box=None, header_style='bold')
    for row in rows:
        table.add_row(*row)
    Console().print(table)


def _print_parameters(rows: Sequence[dict[str, Any]]) -> None:
    table = Table('parameter', 'joint', box=None, header_style='bold')
    for head in ('value', 'std', 'unit'):
        table.add_column(head, justify='right' if head != 'unit' else 'left')
    for row in rows:
        table.add_row(
            row['name'], row['joint'], f'{row["value"]:.5g}', f'{row["std"]:.2g}', row['unit']
        )
    Console().print(table)


def _say(text: str) -> None:
    click.echo(text)


if __name__ == '__main__':
    main()
