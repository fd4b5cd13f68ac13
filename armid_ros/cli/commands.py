# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program `armid`: the group of all commands, and error messages for bad input."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import errno
from functools import cache, partial
from importlib import import_module
import math
import os
from pathlib import Path
import signal
import sys
import threading
import tomllib
from typing import Any

from armid_ros.cli.node import install_hint
from armid_ros.errors import ArmidError, meant, visible
from armid_ros.files import read_text
from armid_ros.plug_ins import load_plug_in, plug_ins
from armid_ros.version import __version__
import click
from click.shell_completion import CompletionItem

#: The commands of the core in the order of the work, and the modules below `armid_ros.cli` that
#: declare them.
COMMANDS = {
    'demo': 'demo.command',
    'convert': 'convert',
    'check': 'inspect',
    'inspect': 'inspect',
    'excite': 'excite',
    'simulate': 'record',
    'call': 'call',
    'identify': 'identify',
    'diagnose': 'diagnose',
    'compare': 'compare',
    'recover': 'record',
    'layout': 'layout',
    'robots': 'catalogues',
    'effects': 'catalogues',
    'export': 'export.command',
}


#: Defaults of options, in the current folder.
FILE = 'armid.toml'
#: Context key of notes, which are printed on stderr after a command succeeds.
NOTES = 'armid.notes'
#: Context key of the arguments as typed.
TYPED = 'armid.typed'


class Commands(click.Group):
    """Group of all armid commands; it imports a command when the command is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of commands in the order of use, then names of plug-in commands."""
        return [*COMMANDS, *sorted(plug_ins('commands').keys() - COMMANDS)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return the command named `cmd_name`; None for an unknown name."""
        if cmd_name in COMMANDS or cmd_name in plug_ins('commands'):
            return _imported(cmd_name)
        return None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """
        Return name, command and further arguments; set defaults of options from armid.toml.

        The error message for an unknown command suggests the most similar command.

        """
        try:
            name, command, rest = super().resolve_command(ctx, args)
        except click.UsageError as error:
            near = meant(args[0], self.list_commands(ctx))
            raise click.UsageError(error.message.rstrip('.') + near, ctx) from error
        ctx.meta[TYPED] = tuple(rest)
        if name and command and not {'-h', '--help'} & set(rest):
            ctx.default_map = {
                name: project_options(
                    name, command, rest, lambda: map(_imported, self.list_commands(ctx))
                )
            }
        return name, command, rest

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write for each command the first sentence of its help, or an import error."""
        rows = []
        for name in self.list_commands(ctx):
            try:
                rows.append((name, _imported(name).get_short_help_str(1000)))
            except (ArmidError, ModuleNotFoundError) as error:
                rows.append((name, str(error)))
        with formatter.section('Commands'):
            formatter.write_dl(rows)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return shell completions: names of commands and options that begin with a text."""
        names = [
            CompletionItem(name) for name in self.list_commands(ctx) if name.startswith(incomplete)
        ]
        return [*names, *click.Command.shell_complete(self, ctx, incomplete)]

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command and print its notes; print a message and exit with 2 for bad input."""
        # SIGTERM interrupts as Ctrl-C does, so that excite keeps its best design
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            result = super().invoke(ctx)
            _print_notes(ctx)
            return result
        except click.exceptions.Exit:  # keeps its exit code
            _print_notes(ctx)
            raise
        except KeyboardInterrupt:
            click.echo('armid: interrupted', err=True)
            sys.exit(130)  # 128 and the number of SIGINT
        except ArmidError as error:
            click.echo(f'armid: {" ".join(str(error).split())}', err=True)
            sys.exit(2)
        except ModuleNotFoundError as error:
            remedy = install_hint(error)
            if remedy is None:
                raise
            click.echo(f'armid: {remedy}', err=True)
            sys.exit(2)
        except OSError as error:  # such as a full disk or a deleted folder
            if error.errno == errno.EPIPE:  # the reader has closed the pipe
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                sys.exit(141)  # 128 and the number of SIGPIPE
            where = f'{error.filename}: ' if error.filename else ''
            click.echo(visible(f'armid: {where}{error.strerror or error}'), err=True)
            sys.exit(2)


def _print_notes(context: click.Context) -> None:
    for note in context.meta.get(NOTES, ()):
        click.echo(note, err=True)


@cache
def _imported(name: str) -> click.Command:
    """Import and return the command named `name`; its options reject infinite numbers."""
    command: click.Command
    if name in COMMANDS:
        module = import_module(f'armid_ros.cli.{COMMANDS[name]}')
        command = getattr(module, name)
    else:
        command = load_plug_in(plug_ins('commands')[name])
    _refuse_infinite(command)
    return command


def _refuse_infinite(command: click.Command) -> None:
    """Let the options of a command and of its subcommands reject infinite numbers."""
    for below in command.commands.values() if isinstance(command, click.Group) else ():
        _refuse_infinite(below)
    for parameter in command.params:
        if isinstance(parameter.type, click.types.FloatParamType):
            parameter.callback = partial(_finite, parameter.callback)


def _finite(
    callback: Callable[..., Any] | None,
    context: click.Context,
    parameter: click.Parameter,
    value: Any,
) -> Any:
    """Return the value of an option after its callback; BadParameter if not finite."""
    for number in value if isinstance(value, tuple) else (value,):
        if number is not None and not math.isfinite(number):
            raise click.BadParameter(f'{number} is not a finite number', context, parameter)
    return value if callback is None else callback(context, parameter, value)


def project_options(
    name: str,
    command: click.Command,
    typed: Sequence[str],
    others: Callable[[], Iterable[click.Command]],
) -> dict[str, Any]:
    """
    Read the defaults of a command from armid.toml; print and return the defaults.

    A key outside of a table sets an option of all commands. A key in the table of a command
    sets the option for that command only.

    Parameters
    ----------
    name : str
        Name of the command, after the name of its group if any; tables are nested likewise.
    command : click.Command
        The command.
    typed : sequence of str
        Arguments as typed; an option among them is not read from the file.
    others : callable
        Returns all commands; called if a key is no option of this command.

    Raises
    ------
    ArmidError
        If the file is no TOML, the table of the command has a key that is none of its options, or
        a key outside of a table is an option of no command.

    """
    if isinstance(command, click.Group):
        below = next((word for word in typed if word in command.commands), '')
        inner = command.commands.get(below)
        return {below: project_options(f'{name} {below}', inner, typed, others)} if inner else {}
    if not Path(FILE).is_file():
        return {}
    try:
        project = tomllib.loads(read_text(Path(FILE), ArmidError))
    except tomllib.TOMLDecodeError as error:
        raise ArmidError(f'{FILE}: {error}') from None
    own: dict[str, Any] = project
    for part in name.split():
        own = own[part] if isinstance(own.get(part), dict) else {}
    given = {key: value for key, value in project.items() if not isinstance(value, dict)} | own
    options = _options(command)
    for key in own.keys() - options.keys():
        raise ArmidError(f"{FILE}: armid {name} has no option '{key}'{meant(key, options)}")
    foreign = given.keys() - options.keys()
    every = {key for one in others() for key in _options(one)} if foreign else set()
    for key in sorted(foreign - every):
        raise ArmidError(f"{FILE}: no command has an option '{key}'{meant(key, every)}")
    words = {text.split('=')[0] for text in typed}
    found = {}
    for key, value in given.items():
        option = options.get(key)
        if option is None or option.name is None or words & {*option.opts, *option.secondary_opts}:
            continue
        if (name, key) == ('export', 'robot') and key not in own:
            continue  # the robot of the model is the default
        values = value if isinstance(value, list) else [value]
        text = ','.join(map(str, values))
        found[option.name] = values if option.multiple else text if value is values else value
        click.echo(f'{FILE}: --{key} {text}', err=True)
    return found


def _options(command: click.Command) -> dict[str, click.Option]:
    """Return the options of a command and its subcommands, by name without dashes."""
    inner = command.commands.values() if isinstance(command, click.Group) else ()
    own = [one for one in command.params if isinstance(one, click.Option)]
    found = {text.lstrip('-'): one for one in own for text in one.opts}
    return {key: one for below in inner for key, one in _options(below).items()} | found


@click.group(cls=Commands, context_settings={'help_option_names': ['-h', '--help']})
@click.version_option(__version__, prog_name='armid')
def main() -> None:
    """
    Identify a robot arm: excite, record, identify, and find effects that the model lacks.

    Exit codes: 0 done, 1 a defect of the program, 2 bad input or data, 130 interrupted. With
    --strict of identify and diagnose, 3 is a result not to be used.

    """
