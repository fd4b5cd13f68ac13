# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From bags to a model with uncertainties."""

from __future__ import annotations

from armid_ros.cli.signatures import columns, options
from armid_ros.cli.signatures.choices import (
    ESTIMATORS,
)
from armid_ros.cli.signatures.late import done_by
import click


@click.command(epilog='Example: armid identify run.mcap --robot ur10.urdf --out result')
@options.bags
@options.robot
@options.folder
@options.validate
@options.effects
@click.option(
    '--method',
    type=click.Choice(ESTIMATORS),
    default='wls',
    show_default=True,
    help='Least squares: all joints alike, weighted by their noise, or robust as well. Against '
    'encoder noise: instruments, closed-loop output error, or a Kalman filter.',
)
@click.option(
    '--methods',
    metavar='M,...',
    help='Compare these methods, or all, side by side on the same data; takes a minute.',
)
@click.option(
    '--cutoff', type=float, help='Of the position filter [Hz]; from the data by default.'
)
@click.option('--decimation', type=int, help='Keep one sample of this many.')
@click.option('--quasi-static', is_flag=True, help='Weight and effects only, for slow motions.')
@click.option(
    '--physical',
    is_flag=True,
    help='Fit links that can be bodies; writes identified.urdf and identified.mjcf.xml too.',
)
@click.option('--total-mass', type=float, help='Of all moving links [kg], with --physical.')
@click.option(
    '--mass-range',
    type=float,
    metavar='FACTOR',
    help='By which a link is lighter or heavier than described at most, with --physical.',
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
    help='What the arm is known to carry in a bag, with its centre in the frame of the link [m]; '
    'fixes the gains of the drives where another bag is without it. May be given several times.',
)
@click.option(
    '--verify/--no-verify',
    'verifies',
    default=True,
    show_default=True,
    help='Test for encoder noise and simulate along the held-out bags.',
)
@click.option('--strict', is_flag=True, help='End with code 3 if the result is unusable.')
@click.option(
    '--verbose', is_flag=True, help='Print every parameter, certificate, note and check too.'
)
@columns.options
@options.topic
@options.gravity
@options.joints
@options.seed
@options.reading
@options.as_json
@done_by('identify')
def identify() -> None:
    """Fit a model with uncertainties to recordings."""
