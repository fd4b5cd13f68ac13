# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The group of all commands, and what happens when one of them is given bad input."""

from __future__ import annotations

import errno
from importlib import import_module
import sys
from typing import Any

from armid_ros.cli.node import lacking
from armid_ros.errors import ArmidError, visible
from armid_ros.version import __version__
import click
from click.shell_completion import CompletionItem

#: Command and module, in the order of the work; a module is imported when its command is called.
COMMANDS = {
    'demo': 'demo.command',
    'convert': 'convert',
    'inspect': 'inspect',
    'excite': 'excite.command',
    'simulate': 'record',
    'identify': 'identify',
    'diagnose': 'diagnose.command',
    'elastic': 'elastic.command',
    'exo': 'exo',
    'lunar': 'lunar',
    'compare': 'compare',
    'fleet': 'fleet',
    'recover': 'record',
    'view': 'view',
    'layout': 'layout',
    'robots': 'catalogues',
    'effects': 'catalogues',
    'completion': 'completion',
}


#: Where the context keeps what is said on stderr when the work was done: an error is one line.
NOTES = 'armid.notes'


class Commands(click.Group):
    """Imports commands late, and reports bad input as one line on stderr and exit code 2."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the commands in the order of the work."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f'armid_ros.cli.{COMMANDS[cmd_name]}')
        command: click.Command = getattr(module, cmd_name)
        return command

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete a command without importing all of them, or an option."""
        names = [CompletionItem(name) for name in COMMANDS if name.startswith(incomplete)]
        return [*names, *click.Command.shell_complete(self, ctx, incomplete)]

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            result = super().invoke(ctx)
            for note in ctx.meta.get(NOTES, ()):
                click.echo(note, err=True)
            return result
        except ArmidError as error:
            click.echo(f'armid: {" ".join(str(error).split())}', err=True)
            sys.exit(2)
        except ModuleNotFoundError as error:
            said = lacking(error)
            if said is None:
                raise
            click.echo(f'armid: {said}', err=True)
            sys.exit(2)
        except OSError as error:  # a disk that is full, a folder that went away
            if error.errno == errno.EPIPE:
                raise
            where = f'{error.filename}: ' if error.filename else ''
            click.echo(visible(f'armid: {where}{error.strerror or error}'), err=True)
            sys.exit(2)


@click.group(cls=Commands, context_settings={'help_option_names': ['-h', '--help']})
@click.version_option(__version__, prog_name='armid')
def main() -> None:
    """Identify a robot arm: excite, record, identify, and find what the model lacks."""
