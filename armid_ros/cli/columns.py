# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Command options that state the columns of a table, units and signs of a recording."""

from __future__ import annotations

from functools import partial
from typing import Any, TYPE_CHECKING

from armid_ros.cli import parameters
from armid_ros.cli.choices import TIME_UNITS
from armid_ros.cli.parameters import together
from armid_ros.errors import RecordingError
from armid_ros.files.cells import listed
import click

if TYPE_CHECKING:
    from armid_ros.recording.columns import ColumnSettings

#: Key of the context for the values of these options.
META = 'armid.columns'


def _kept(ctx: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """Store the value of an option in click's context, and return the value."""
    ctx.meta.setdefault(META, {})[parameter.name] = value
    return value


#: Declaration of an option whose value is stored in the context, not passed to the command.
_option = partial(click.option, callback=_kept, expose_value=False)


def _rules(ctx: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """Store the pairs (old, new) of --rename in click's context; return the pairs."""
    rules = []
    for text in value:
        old, *new = listed(text, ':')
        if not new:
            first, equals, second = text.partition('=')
            right = f'{first}:{second}' if equals else f'{text}:NEW'
            raise RecordingError(
                f"--rename '{text}' is not of the form OLD:NEW. Put names with blanks in quotes, "
                f"and repeat the option for each pair: --rename '{right}' --rename fer_:panda_"
            )
        rules.append((old, ':'.join(new)))
    return _kept(ctx, parameter, tuple(rules))


def _couplings(ctx: click.Context, parameter: click.Parameter, value: Any) -> Any:
    """Store (motor, joint, ratio) of each --coupling in click's context, and return all."""
    couplings = []
    for text in value:
        pair, equals, ratio = text.rpartition('=')
        names = listed(pair)
        if not equals or len(names) != 2:
            raise RecordingError(f"--coupling '{text}' has to be MOTOR,JOINT=RATIO, as in 6,5=32")
        from armid_ros.recording.columns import number

        couplings.append((names[0].strip(), names[1].strip(), number(ratio)))
    return _kept(ctx, parameter, tuple(couplings))


def _numbers(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
    """Store the numbers of an option in click's context: one number, or one per joint."""
    if value is not None:
        from armid_ros.recording.columns import numbers

        return _kept(ctx, parameter, numbers(value))
    return _kept(ctx, parameter, ())


#: The options; `settings` returns their values.
options = together(
    _option('--time', metavar='C', help='Column of time of a table; guessed by default.'),
    _option(
        '--position',
        metavar='C',
        help="Columns of positions: 'q{}' where {} is a joint's name or number, 'q[1..7]', or "
        'names with commas; guessed by default.',
    ),
    _option(
        '--velocity',
        metavar='C',
        help="Columns of velocities, written as for --position; 'none' skips velocities.",
    ),
    _option(
        '--effort',
        metavar='C',
        help='Columns of torques, forces or currents, written as for --position.',
    ),
    _option(
        '--temperature',
        metavar='C',
        help="Columns of temperatures [degC], written as for --position; 'none' skips them, "
        'for bags too.',
    ),
    _option(
        '--time-unit', type=click.Choice(TIME_UNITS), help='Unit of the time column of a table.'
    ),
    _option(
        '--rate',
        'rate_hz',
        type=float,
        metavar='HZ',
        help='Sample rate [Hz] of a table without a time column.',
    ),
    _option(
        '--degrees', is_flag=True, help='Positions and velocities are in degrees; for bags too.'
    ),
    _option(
        '--position-scale',
        callback=_numbers,
        metavar='X,...',
        help='Factor of positions and velocities to rad or m, one or one per joint; for bags too.',
    ),
    _option(
        '--effort-scale',
        '--current-gain',
        callback=_numbers,
        metavar='X,...',
        help='Factor of efforts to N m or N: torque constant [N m/A], gear ratio as 1798/7, sign; '
        'for bags too.',
    ),
    _option(
        '--zero',
        callback=_numbers,
        metavar='X,...',
        help="Offset added to the positions [rad or m], as '-pi/2'; for bags too.",
    ),
    _option(
        '--gear',
        callback=_numbers,
        metavar='X,...',
        help='Gear ratio: turns of the motor per turn of the joint. The values are then those of '
        'the motors; for bags too.',
    ),
    _option(
        '--coupling',
        multiple=True,
        callback=_couplings,
        metavar='I,J=X',
        help='With --gear: motor I also turns X times per turn of joint J.',
    ),
    _option(
        '--rename',
        multiple=True,
        callback=_rules,
        metavar='OLD:NEW',
        help='Beginning of joint names in the file, and in the description; for bags too.',
    ),
    _option('--episode', type=int, metavar='N', help='Episode of a LeRobot dataset.'),
)

#: Options for reading recordings and printing results.
recordings = together(options, parameters.topic, parameters.setting, parameters.as_json)


def settings() -> ColumnSettings:
    """Return the settings of table columns from the options of the running command."""
    from armid_ros.recording.columns import ColumnSettings

    return ColumnSettings(**click.get_current_context().meta.get(META, {}))
