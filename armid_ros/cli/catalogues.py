# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The commands `armid robots` and `armid effects`: lists of shipped robots and of effects."""

from __future__ import annotations

import textwrap

from armid_ros.cli import parameters
from armid_ros.cli.terminal import say
import click


@click.command(epilog='Example: armid robots')
@parameters.as_json
def robots(as_json: bool) -> None:
    """List the robots that are shipped with this program."""
    from armid_ros.files import json_text
    from armid_ros.robots import shipped_robots

    rows = [{'name': name, 'what it is': text} for name, text in shipped_robots().items()]
    if as_json:
        click.echo(json_text(rows, indent=1))
        return
    for row in rows:
        _say_wrapped(f'{row["name"]}: {row["what it is"]}')


@click.command(epilog='Example: armid effects payload')
@click.argument('names', nargs=-1, metavar='[NAME]...', shell_complete=parameters.completed)
@parameters.as_json
def effects(names: tuple[str, ...], as_json: bool) -> None:
    """List all effects that can be simulated and estimated, or describe the named effects."""
    from armid_ros.effects import CATALOGUE
    from armid_ros.files import json_text

    rows = [
        {
            'name': name,
            'what it is': ' '.join(str(effect.__doc__).partition('\n\n')[0].split())
            if names and effect.__module__.startswith('armid_ros.')
            else effect.summary,
            'parameters': [_with_unit(q.name, q.unit) for q in effect.quantities],
            'shapes': [_with_unit(s.name, s.unit) for s in effect.shapes],
        }
        for name, effect in ((name, CATALOGUE.find(name)) for name in names or CATALOGUE)
    ]
    if as_json:
        click.echo(json_text(rows, indent=1))
        return
    for row in rows:
        _say_wrapped(f'{row["name"]}: {row["what it is"]}')
        for kind, head in (('parameters', ''), ('shapes', 'shape: ')):
            if row[kind]:
                _say_wrapped(f'    {head}{", ".join(row[kind])}')


def _say_wrapped(text: str) -> None:
    say(textwrap.fill(text, 80, subsequent_indent='    ', break_on_hyphens=False))


def _with_unit(name: str, unit: str) -> str:
    return f'{name} [{unit}]' if unit else name
