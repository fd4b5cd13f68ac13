# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command `armid identify`: an arm model with uncertainties, identified from recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armid_ros.cli import columns, parameters
from armid_ros.cli.choices import ESTIMATORS
from armid_ros.cli.terminal import progress
import click


@click.command(epilog='Example: armid identify run.mcap --robot ur10.urdf --out result')
@parameters.bags
@parameters.robot
@parameters.folder
@parameters.validate
@parameters.effects
@click.option(
    '--method',
    type=click.Choice(ESTIMATORS),
    default='wls',
    show_default=True,
    help='Least squares: ordinary, weighted by the noise of joints, or weighted and robust. '
    'Against encoder noise: instrumental variables.',
)
@parameters.cutoff
@parameters.decimation
@click.option('--quasi-static', is_flag=True, help='Gravity and effects only, for slow motions.')
@click.option(
    '--physical/--no-physical',
    default=None,
    help='Fit physically consistent links, for identified.urdf and identified.mjcf.xml. By '
    'default if the torque error grows by a tenth at most.',
)
@click.option('--total-mass', type=float, help='Mass of all moving links [kg], with --physical.')
@click.option(
    '--mass-range',
    type=float,
    metavar='FACTOR',
    help='Factor by which a link may be lighter or heavier than described, with --physical.',
)
@click.option(
    '--box',
    'boxes',
    multiple=True,
    metavar='JOINT=X,Y,Z:X,Y,Z',
    help='Two corners [m], in the frame of the joint, of a box that contains its link, with '
    '--physical; may be given several times.',
)
@click.option(
    '--payload',
    'payloads',
    multiple=True,
    metavar='BAG=KG@LINK[:X,Y,Z]',
    help='Known payload of a bag, with its centre in the frame of the link [m]. A loaded and an '
    'unloaded bag determine the gains of the drives. May be given several times.',
)
@click.option(
    '--verify/--no-verify',
    default=True,
    show_default=True,
    help='Test for encoder noise and simulate along the held-out bags.',
)
@parameters.every
@click.option('--strict', is_flag=True, help='End with code 3 if the result is unusable.')
@columns.recordings
def identify(
    bags: tuple[Path, ...],
    robot_source: str,
    gravity: str,
    joints: str | None,
    topic: str | None,
    out: Path,
    validate: tuple[Path, ...],
    effects: str,
    quasi_static: bool,
    physical: bool | None,
    every: bool,
    total_mass: float | None,
    mass_range: float | None,
    boxes: tuple[str, ...],
    strict: bool,
    seed: int,
    as_json: bool,
    **settings: Any,
) -> None:
    """Identify an arm model with confidence intervals from recordings."""
    from armid_ros.api.arguments import with_effects
    from armid_ros.api.identification import IdentificationResult
    from armid_ros.api.identification import identify as run
    from armid_ros.arm import ArmModel
    from armid_ros.cli import options
    from armid_ros.errors import IdentificationError
    from armid_ros.identification import PhysicalSettings

    staged = options.stage(out, IdentificationResult.schema, robot_source)
    robot = options.open_robot(robot_source, gravity, joints, bags, tell=False)
    arm = with_effects(ArmModel(robot, quasi_static=quasi_static), effects)
    if not physical and (total_mass is not None or mass_range is not None or boxes):
        raise IdentificationError('--total-mass, --mass-range and --box need --physical')
    corners = dict(options.box(text, robot) for text in boxes)
    known = PhysicalSettings(total_mass=total_mass, boxes=corners, mass_range=mass_range)
    with progress('reading') as tick:
        result = run(
            arm,
            options.read(bags, robot, topic),
            validate=options.read(validate, robot, topic),
            physical=known if physical else physical,
            rng=seed,
            progress=tick,
            **settings,
        )
        tick(1.0, 'writing')
        origin = options.origin(
            robot_source,
            [*bags, *validate],
            seed,
            source=options.kept_source(robot_source, robot, staged.folder),
        )
        options.deliver(result, staged, origin, as_json, result.summary(every))
    if strict and result.grade == 'unusable':
        click.get_current_context().exit(3)
