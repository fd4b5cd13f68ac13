# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A trajectory worth running."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armid_ros.cli.signatures import options
from armid_ros.cli.signatures.choices import (
    COURSES,
    CRITERIA,
    FOURIER,
    MAX_DURATION,
    SPEED_CLASSES,
    TARGETS,
)
from armid_ros.cli.signatures.late import done_by
import click


class Speeds(click.ParamType[tuple[str | float, ...]]):
    """Speed classes, or shares of the velocity and acceleration limits, with commas."""

    name = 'speeds'

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[str | float, ...]:
        """Read them."""
        return tuple(self._one(part.strip()) for part in str(value).split(','))

    def _one(self, text: str) -> str | float:
        if text in SPEED_CLASSES:
            return text
        try:
            return float(text)
        except ValueError:
            self.fail(f"'{text}' is neither one of {', '.join(SPEED_CLASSES)} nor a number")


@click.command(epilog='Example: armid excite --robot ur5.urdf --duration 40 --out plan')
@options.robot
@options.folder
@click.option(
    '--kind',
    type=click.Choice([FOURIER, *COURSES]),
    default=FOURIER,
    show_default=True,
    help='Designed; or for elastic joints, a bag alone: multisines of torque on the move, steps.',
)
@click.option(
    '--share',
    type=click.FloatRange(0.0, 1.0, min_open=True),
    default=0.1,
    show_default=True,
    help='Of the torque limits (multisine, rms) or of the velocity limits (steps).',
)
@click.option(
    '--duration',
    type=click.FloatRange(0.0, MAX_DURATION, min_open=True),
    default=44.0,
    show_default=True,
    help='From rest to rest [s].',
)
@click.option(
    '--periods',
    type=click.IntRange(min=2),
    default=2,
    show_default=True,
    help='Identical periods in it; their difference is the noise.',
)
@click.option('--harmonics', default=5, show_default=True, help='Per joint.')
@click.option(
    '--speed',
    'speeds',
    type=Speeds(),
    metavar='S,...',
    default='fast',
    show_default=True,
    help=f'{", ".join(SPEED_CLASSES)}, or a share of the limits; several: a folder for each.',
)
@click.option(
    '--criterion',
    type=click.Choice(list(CRITERIA)),
    default='D',
    show_default=True,
    help='; '.join(f'{name}: {what}' for name, what in CRITERIA.items()),
)
@click.option(
    '--target',
    type=click.Choice(list(TARGETS)),
    default='all',
    show_default=True,
    help='; '.join(f'{name}: {what}' for name, what in TARGETS.items()),
)
@click.option(
    '--focus',
    default='',
    metavar='E,...',
    help='Effects to see best, everything else being fitted too.',
)
@options.effects
@click.option(
    '--effect',
    'texts',
    multiple=True,
    metavar='NAME:k=v',
    help='An effect of known size, which counts against the torque limits.',
)
@click.option(
    '--rival',
    metavar='E,...|none',
    help='With --criterion T: what may be there in place of --effect.',
)
@click.option(
    '--model', type=click.Path(path_type=Path), help='model.yaml with what is known of the arm.'
)
@click.option(
    '--start',
    metavar='Q,...',
    help='Pose that the trajectory leaves and returns to [rad or m]; zero by default.',
)
@click.option(
    '--acceleration',
    metavar='A[,...]',
    help='Limit of each joint [rad/s^2 or m/s^2]; top speed in 0.25 s by default.',
)
@click.option(
    '--joint-limits',
    type=click.Path(path_type=Path),
    help='joint_limits.yaml of MoveIt: velocity and acceleration limits.',
)
@click.option(
    '--velocity',
    multiple=True,
    metavar='JOINT:=V',
    help='Velocity limit of a joint [rad/s or m/s]. May be given several times.',
)
@click.option(
    '--torque-noise',
    metavar='N[,...]',
    help='Standard deviation at each joint [N m or N]; 1 % of the torque limit by default.',
)
@click.option('--clearance', default=0.01, show_default=True, help='Between links [m].')
@click.option(
    '--environment',
    type=click.Path(path_type=Path),
    help='YAML with what stands around the arm, or a planning scene of MoveIt.',
)
@click.option(
    '--floor',
    metavar='Z|none',
    help='Height of the floor above the origin of the base [m]; without it and without '
    '--environment, the base plane of an arm that stands.',
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
@click.option(
    '--time-budget',
    default=120.0,
    show_default=True,
    help='At most so much processor time in each search process [s].',
)
@options.gravity
@options.joints
@options.seed
@options.reading
@options.as_json
@done_by('excite.command')
def excite() -> None:
    """Design a trajectory that shows the parameters, inside all limits and free of collisions."""
