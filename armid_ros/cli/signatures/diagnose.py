# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From bags and a model to what the model lacks."""

from __future__ import annotations

import math
from pathlib import Path

from armid_ros.cli.signatures import columns, options, partner
from armid_ros.cli.signatures.late import done_by
import click


class Percent(click.ParamType):  # type: ignore[type-arg]
    """A share that a person writes in per cent, with or without the sign."""

    name = 'percent'

    def convert(
        self, value: str | float, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the share, 0 to 1."""
        if isinstance(value, float):
            return value
        try:
            share = float(value.removesuffix('%')) / 100.0
        except ValueError:
            share = math.nan
        if not 0.0 <= share < 1.0:
            self.fail(f"'{value}' is not a percentage from 0% to 100%", param, ctx)
        return share


@click.command(epilog='Example: armid diagnose slow.mcap fast.mcap --robot ur10.urdf --out found')
@options.bags
@options.robot
@options.folder
@options.validate
@click.option(
    '--model',
    type=click.Path(path_type=Path),
    help='model.yaml with what is known of the arm; its effects are part of the model.',
)
@click.option(
    '--baseline',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='A bag from when nothing was wrong, to ask what has changed since; may be given several '
    'times. By default what --model was identified from, where it is there.',
)
@click.option(
    '--no-baseline',
    is_flag=True,
    help='Ask without those recordings: the misfit that identify wrote into --model is what the '
    'gap is beyond.',
)
@click.option(
    '--material',
    type=Percent(),
    default='1%',
    show_default=True,
    metavar='PERCENT',
    help="Share of a joint's torque (rms) below which an effect does not matter.",
)
@click.option(
    '--all', 'everything', is_flag=True, help='Add effects to the model that do not matter, too.'
)
@click.option(
    '--effects',
    default='',
    metavar='E,...',
    help="Effects that the model has already, fitted anew; 'E@joint+joint' for some joints only.",
)
@click.option(
    '--residual',
    type=click.Choice(['gp']),
    help='Learn what is left without a name, where the verdict is partial or unknown, as a map '
    'with its uncertainty (gp: a Gaussian process of each joint), and suggest a law.',
)
@click.option(
    '--strict',
    is_flag=True,
    help='End with code 3 if something is there and has no name (unknown, not_repeatable). Data '
    'that cannot be diagnosed (bad_data) end with code 2 in any case.',
)
@click.option('--cutoff', type=float, help='Of the position filter [Hz]; from the data if none.')
@click.option('--decimation', type=int, help='Keep one sample of this many.')
@columns.options
@options.topic
@partner.options
@options.gravity
@options.joints
@options.seed
@options.reading
@options.as_json
@done_by('diagnose.command')
def diagnose() -> None:
    """Find which effect a model lacks, and add it."""
