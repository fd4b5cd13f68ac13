# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The group of all commands, and what happens when one of them is given bad input."""

from __future__ import annotations

import sys
from typing import Any

from armid_ros import __version__
from armid_ros.cli.catalogues import effects, robots
from armid_ros.cli.excite import excite
from armid_ros.cli.identify import identify
from armid_ros.cli.record import recover, simulate
from armid_ros.errors import ArmidError
import click


class Commands(click.Group):
    """Reports bad input as one line on stderr and exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except ArmidError as error:
            click.echo(f'armid: {error}', err=True)
            sys.exit(2)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the commands in the order of the work."""
        return list(self.commands)


@click.group(cls=Commands, context_settings={'help_option_names': ['-h', '--help']})
@click.version_option(__version__, prog_name='armid')
def main() -> None:
    """Identify a robot arm: excite, record, identify, and find what the model lacks."""


for command in (excite, simulate, identify, recover, robots, effects):
    main.add_command(command)
