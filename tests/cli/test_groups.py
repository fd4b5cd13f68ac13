# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every option of a command is a parameter of its function."""

import inspect

from armid_ros.cli import main
import click
from click.testing import CliRunner
import pytest


def commands(group, path=()):
    """Yield all commands with their names, and those of the groups in it."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))
        else:
            yield ' '.join((*path, name)), command


COMMANDS = dict(commands(main))


@pytest.mark.parametrize('name', COMMANDS)
def test_a_command_takes_its_options_and_nothing_else(name):
    command = COMMANDS[name]
    parameters = inspect.signature(command.callback).parameters.values()
    taken = {p.name for p in parameters if p.kind is not p.VAR_KEYWORD}
    options = {parameter.name for parameter in command.params if parameter.expose_value}
    assert taken <= options
    if len(taken) == len(parameters):
        assert taken == options


def test_a_misspelt_command_is_corrected():
    result = CliRunner().invoke(main, ['identfy'])
    assert result.exit_code == 2 and "'identify'" in result.output
