# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A trajectory worth running."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.cli import options
from armid_ros.cli.terminal import progress, say
from armid_ros.excitation import (
    CRITERIA,
    Design,
    design,
    DesignSettings,
    load_environment,
    Problem,
    Progress,
    save_excitation,
    SPEED_CLASSES,
    TARGETS,
)
from armid_ros.identification.signals import conditioning, segments, SignalSettings
from armid_ros.motion import FloatArray
from armid_ros.recording import write_joint_trajectory
from armid_ros.report.figures import excitation_figure, save_figure
from armid_ros.robots import collision_model
import click
import numpy as np

#: Waypoints per second of the JointTrajectory; controllers interpolate between them.
WAYPOINT_RATE = 50.0


class Speed(click.ParamType[str | float]):
    """A speed class or a share of the velocity and acceleration limits."""

    name = 'speed'

    def convert(self, value: Any, param: Any, ctx: Any) -> str | float:
        """Read one."""
        if value in SPEED_CLASSES:
            return str(value)
        try:
            return float(value)
        except ValueError:
            self.fail(f'{value}: neither one of {", ".join(SPEED_CLASSES)} nor a number')


@click.command(epilog='Example: armid excite --robot ur5.urdf --duration 40 --out plan')
@options.robot
@options.folder
@click.option('--duration', default=44.0, show_default=True, help='From rest to rest [s].')
@click.option('--periods', default=2, show_default=True, help='Identical periods in it.')
@click.option('--harmonics', default=5, show_default=True, help='Per joint.')
@click.option(
    '--speed',
    type=Speed(),
    default='fast',
    show_default=True,
    help=f'{", ".join(SPEED_CLASSES)}, or a share of the limits.',
)
@click.option('--criterion', type=click.Choice([c for c in CRITERIA if c != 'T']), default='D')
@click.option('--target', type=click.Choice(list(TARGETS)), default='all')
@click.option('--clearance', default=0.01, show_default=True, help='Between links [m].')
@click.option(
    '--environment', type=click.Path(path_type=Path), help='YAML with what stands around the arm.'
)
@click.option(
    '--after',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='A bag recorded already: add most to what it tells. May be given several times.',
)
@click.option('--starts', default=4, show_default=True, help='Searches from other beginnings.')
@click.option('--iterations', default=150, show_default=True, help='Of each search.')
@click.option('--time-budget', default=120.0, show_default=True, help='At most so long [s].')
@options.effects
@options.gravity
@options.joints
@options.seed
@options.as_json
def excite(
    robot_source: str,
    out: Path,
    duration: float,
    periods: int,
    harmonics: int,
    speed: str | float,
    criterion: str,
    target: str,
    clearance: float,
    environment: Path | None,
    after: tuple[Path, ...],
    starts: int,
    iterations: int,
    time_budget: float,
    effects: str,
    gravity: str,
    joints: str | None,
    seed: int,
    as_json: bool,
) -> None:
    """Design a trajectory that shows the parameters, inside all limits and free of collisions."""
    robot = options.open_robot(robot_source, gravity, joints)
    arm = options.with_effects(ArmModel(robot), effects)
    run_in = min(2.0, 0.1 * duration)
    settings = DesignSettings(
        period=(duration - 2.0 * run_in) / periods,
        n_periods=periods,
        run_in=run_in,
        harmonics=harmonics,
        speed=speed,
        criterion=criterion,
        target=target,
        clearance=clearance,
        starts=starts,
        iterations=iterations,
        time_budget=time_budget,
    )
    collision = collision_model(robot)
    obstacles = load_environment(environment) if environment else ()
    with progress('designing') as tick:

        def told(now: Progress) -> None:
            tick(now.done, f'designing, cost {now.cost:.2f}')

        result = design(
            arm,
            settings,
            np.random.default_rng(seed),
            collision=collision,
            obstacles=obstacles,
            prior_information=_known(arm, settings, after, seed) if after else None,
            progress=told,
        )
    out.mkdir(parents=True, exist_ok=True)
    save_excitation(result.excitation, out / 'excitation.yaml')
    save_excitation(result.excitation, out / 'excitation.csv')
    motion = result.excitation.motion(WAYPOINT_RATE)
    write_joint_trajectory(out / 'trajectory', motion, robot_description=robot.urdf)
    figure = excitation_figure(
        robot,
        result.excitation,
        collision=collision,
        margin=clearance,
        information=result.information,
    )
    save_figure(figure, out / 'excitation.png')
    document = _document(result, float(collision.path_clearance(motion.q).min()))
    (out / 'excitation.json').write_text(json.dumps(document, indent=1), encoding='utf-8')
    if as_json:
        click.echo(json.dumps(document))
        return
    say(f'condition number {document["condition_number"]:.1f}, rank {document["rank"]}')
    say(f'smallest clearance {1e3 * document["clearance"]:.0f} mm, no limit violated')
    say(f'{out}: excitation.yaml, excitation.csv, excitation.png, trajectory (a bag)')


def _known(arm: ArmModel, settings: DesignSettings, bags: Sequence[Path], seed: int) -> FloatArray:
    """Return the information that recordings hold already, shape (r, r)."""
    recordings = options.read(bags, arm.robot, None)
    used = conditioning(recordings, SignalSettings())
    problem = Problem.of(arm, settings, np.random.default_rng(seed))
    size = len(problem.base.parameters)
    matrix = np.zeros((size, size))
    for recording in recordings:
        for motion in segments(recording, used):
            thinned = motion.select(slice(None, None, used.decimation))
            matrix += problem.information(thinned, recording.duration * settings.rate).matrix
    return matrix


def _document(result: Design, clearance: float) -> dict[str, Any]:
    information = result.information
    return {
        'schema': 'armid/excitation/1',
        'joints': list(result.excitation.joints),
        'duration': result.excitation.duration,
        'condition_number': information.condition,
        'log_det': information.log_det,
        'rank': len(information.parameters),
        'clearance': clearance,
        'parameters': [
            {'name': name.name, 'joint': name.joint, 'std': float(std), 'unit': name.unit}
            for name, std in zip(information.parameters, information.std, strict=True)
        ],
    }
