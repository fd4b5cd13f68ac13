# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Declarations of the options that several commands have."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
import shlex
from typing import Any, TypeVar

from armid_ros.cli.choices import HOW_OFTEN, SPEED_CLASSES, USUAL_EFFECTS
from armid_ros.files.cells import listed
import click

_Command = TypeVar('_Command', bound=Callable[..., Any])

#: Context keys of values that several options and commands share.
FORCE, CRC, MEMORY = 'armid.force', 'armid.crc', 'armid.memory'
PACKAGES = 'armid.packages'


def together(*options: Callable[[Any], Any]) -> Callable[[_Command], _Command]:
    """Return a decorator that adds several options to a command, in this order."""

    def add(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return add


class OutPath(click.Path):
    """Option type for an output path; an empty path is an error."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the output path; raise an error if it is empty."""
        if not str(value).strip():
            self.fail('the path is empty; name a folder, or . for this one', param, ctx)
        return super().convert(value, param, ctx)


class ModelPath(click.Path):
    """Option type for a model.yaml, or for a results folder that contains one."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path of a model.yaml: the given file, or the file in the given folder."""
        path = Path(str(super().convert(value, param, ctx)))
        return path / 'model.yaml' if path.is_dir() else path


def completed(_: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return shell completions for the last name of a list: robots, effects or choices."""
    before, sign, last = incomplete.rpartition('=' if parameter.name == 'priors' else ',')
    words = {'gravity': ('earth', 'moon'), 'speed': SPEED_CLASSES, 'priors': HOW_OFTEN}
    names: Iterable[str] = words.get(str(parameter.name), ())
    if parameter.name == 'robot_source':
        from armid_ros.robots import shipped_robots

        names = shipped_robots()
    elif not names or (names is HOW_OFTEN and not sign):
        from armid_ros.effects import CATALOGUE

        names = CATALOGUE
    return [f'{before}{sign}{name}' for name in names if name.startswith(last)]


def names(_: click.Context, parameter: click.Parameter, value: str | None) -> tuple[str, ...]:
    """Split a list of names at commas that are outside double quotes."""
    return listed(value) if value else ()


gravity = click.option(
    '--gravity',
    shell_complete=completed,
    default='earth',
    show_default=True,
    help='Gravity: earth, moon, or x,y,z in the base frame [m/s^2].',
)
joints = click.option(
    '--joints',
    default=None,
    metavar='A,B,...',
    help='Driven joints; all but grippers by default. Write a name with a comma in double quotes.',
)
effects = click.option(
    '--effects',
    default=','.join(USUAL_EFFECTS),
    show_default=True,
    metavar='E,...',
    shell_complete=completed,
    help="Effects added to the rigid body; 'E@joint+joint' for some joints only.",
)
force = click.option(
    '--force',
    is_flag=True,
    expose_value=False,
    callback=lambda context, _, value: context.meta.update({FORCE: value}),
    help='Overwrite results of another kind or robot, and files of other programs.',
)
#: Options on the folder of results, and on overwriting.
folder = together(
    click.option(
        '--out',
        required=True,
        type=OutPath(file_okay=False, path_type=Path),
        help='Folder for the results.',
    ),
    force,
)
#: Options for reading bags.
reading = together(
    click.option(
        '--crc/--no-crc',
        default=True,
        show_default=True,
        expose_value=False,
        callback=lambda context, _, value: context.meta.update({CRC: value}),
        help='Compare the checksums of bags, and skip damaged parts.',
    ),
    click.option(
        '--memory-limit',
        type=click.FloatRange(0.0, min_open=True),
        metavar='MB',
        expose_value=False,
        callback=lambda context, _, value: context.meta.update({MEMORY: value}),
        help='Memory limit for reading bags [MB]; a quarter of the memory by default.',
    ),
)
bag = click.option(
    '--out', required=True, type=OutPath(path_type=Path), help='Bag to write; must not exist.'
)
bags = click.argument('bags', nargs=-1, required=True, type=click.Path(path_type=Path))
validate = click.option(
    '--validate',
    multiple=True,
    type=click.Path(path_type=Path),
    metavar='BAG',
    help='Held-out bag, predicted and not fitted; may be given several times.',
)
cutoff = click.option(
    '--cutoff', type=float, help='Cut-off of the position filter [Hz]; from the data by default.'
)
decimation = click.option('--decimation', type=int, help='Decimation: fit every k-th sample.')
topic = click.option('--topic', help='JointState topic to read, if a bag has several.')
seed = click.option(
    '--seed',
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help='Random seed.',
)
#: Options on gravity, driven joints, random seed and reading of bags.
setting = together(gravity, joints, seed, reading)
every = click.option('--all', 'every', is_flag=True, help='Print all values.')
as_json = click.option('--json', 'as_json', is_flag=True, help='Print the result as JSON.')
packages = click.option(
    '--package',
    multiple=True,
    metavar='PACKAGE=FOLDER',
    is_eager=True,
    expose_value=False,
    callback=lambda context, _, values: context.meta.update({PACKAGES: values}),
    help='Folder of a ROS package that the description refers to; may be given several times.',
)


def robot_described(**values: Any) -> Callable[[_Command], _Command]:
    """Return a decorator that adds the options --robot and --package."""
    source = click.option(
        '--robot',
        'robot_source',
        metavar='R',
        shell_complete=completed,
        callback=lambda context, _, source: with_packages(context, source),
        **values,
    )
    return together(source, packages)


def with_packages(context: click.Context, source: str | None) -> str | None:
    """Return the text of --robot with the folders of --package appended."""
    written = []
    for text in context.meta.get(PACKAGES, []):
        name, _, folder = text.partition('=')
        if not name or not folder:
            raise click.BadParameter(f"'{text}' has to be PACKAGE=FOLDER", param_hint='--package')
        if source in (None, '-'):
            raise click.BadParameter(
                f"'{text}': a package folder needs --robot with a description file",
                param_hint='--package',
            )
        written.append(shlex.quote(f'package:{name}:={Path(folder).resolve()}'))
    return ' '.join([source, *written]) if source and written else source


robot = robot_described(
    required=True,
    help='Shipped name, path of a URDF, MJCF or xacro ("arm.xacro tool:=true" with '
    'arguments), or - for the /robot_description in the bag. '
    'A xacro is a program, which can read any file: name only one that you trust.',
)
