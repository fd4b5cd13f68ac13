# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The group of all commands, and what happens when one of them is given bad input."""

from __future__ import annotations

import errno
from importlib import import_module
import sys
from typing import Any

from armid_ros import __version__
from armid_ros.errors import ArmidError, visible
import click

#: Command and module, in the order of the work; a module is imported when its command is called.
COMMANDS = {
    'demo': 'demo',
    'convert': 'convert',
    'inspect': 'inspect',
    'excite': 'excite',
    'simulate': 'record',
    'identify': 'identify',
    'diagnose': 'diagnose',
    'elastic': 'elastic',
    'exo': 'exo',
    'lunar': 'lunar',
    'compare': 'compare',
    'recover': 'record',
    'layout': 'layout',
    'robots': 'catalogues',
    'effects': 'catalogues',
}


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

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except ArmidError as error:
            click.echo(f'armid: {" ".join(str(error).split())}', err=True)
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
