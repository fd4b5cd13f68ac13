# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options reach a command as settings objects, every one of them."""

from dataclasses import dataclass, fields
import inspect

from armid_ros.cli import main
from armid_ros.cli.groups import gathered
import click
from click.testing import CliRunner
import pytest


@dataclass(frozen=True)
class Size:
    width: float
    height: float


def commands(group, path=()):
    """Yield all commands with their names, and those of the groups in it."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))
        else:
            yield ' '.join((*path, name)), command


WORK = {
    name: (command, command.callback.work())
    for name, command in commands(main)
    if hasattr(command.callback, 'work')
}
GROUPED = [name for name, (_, work) in WORK.items() if hasattr(work, 'gathered')]


def test_options_of_a_group_come_as_one_object_and_the_others_as_they_are():
    seen = []

    @click.command()
    @click.option('--width', default=2.0)
    @click.option('--height', default=3.0)
    @click.option('--name', default='box')
    @gathered(size=Size)
    def draw(size, name):
        seen.append((size, name))

    CliRunner().invoke(draw, ['--height', '5'], catch_exceptions=False)
    assert seen == [(Size(2.0, 5.0), 'box')]


@pytest.mark.parametrize('name', GROUPED)
def test_every_field_of_a_group_is_an_option_and_no_option_is_in_two(name):
    command, work = WORK[name]
    named = [field.name for kind in work.gathered.values() for field in fields(kind)]
    options = {parameter.name for parameter in command.params if parameter.expose_value}
    assert len(named) == len(set(named))
    assert set(named) <= options


@pytest.mark.parametrize('name', WORK)
def test_what_does_a_command_takes_its_options_and_nothing_else(name):
    command, work = WORK[name]
    kinds = getattr(work, 'gathered', {})
    taken = [p for p in inspect.signature(work).parameters if p not in kinds]
    taken += [field.name for kind in kinds.values() for field in fields(kind)]
    assert sorted(taken) == sorted(p.name for p in command.params if p.expose_value)
