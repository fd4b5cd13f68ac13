# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Every option of a command reaches the function that does its work."""

from dataclasses import fields
import inspect

from armid_ros.cli import main
import click
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
    work = command.callback.work() if hasattr(command.callback, 'work') else command.callback
    kinds = getattr(work, 'gathered', {})
    parameters = inspect.signature(work).parameters.values()
    taken = [p.name for p in parameters if p.kind is not p.VAR_KEYWORD and p.name not in kinds]
    taken += [field.name for kind in kinds.values() for field in fields(kind)]
    options = [parameter.name for parameter in command.params if parameter.expose_value]
    assert len(taken) == len(set(taken)) and set(taken) <= set(options)
    if not any(p.kind is p.VAR_KEYWORD for p in parameters):
        assert set(taken) == set(options)
