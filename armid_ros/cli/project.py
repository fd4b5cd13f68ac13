# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options of a project: what armid.toml of the current folder gives where no option is typed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
import tomllib
from typing import Any

from armid_ros.errors import ArmidError, meant
from armid_ros.files import read_text
import click

FILE = 'armid.toml'


def project_options(
    name: str,
    command: click.Command,
    typed: Sequence[str],
    others: Callable[[], Iterable[click.Command]],
) -> dict[str, Any]:
    """
    Return the defaults of a command from armid.toml, and print them on stderr.

    A key outside of a table is for every command that has an option of this name; a key in the
    table of a command is for that one.

    Parameters
    ----------
    name : str
        Of the command; of one in a group with that before it, and its table below the group's.
    command : click.Command
        The command.
    typed : sequence of str
        Its arguments as they were typed: an option among them is not looked up.
    others : callable
        Returns all commands; called where a key is no option of this one.

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
        values = value if isinstance(value, list) else [value]
        text = ','.join(map(str, values))
        found[option.name] = values if option.multiple else text if value is values else value
        click.echo(f'{FILE}: --{key} {text}', err=True)
    return found


def _options(command: click.Command) -> dict[str, click.Option]:
    """Return the options of a command, and of those in a group, by their long names."""
    inner = command.commands.values() if isinstance(command, click.Group) else ()
    own = [one for one in command.params if isinstance(one, click.Option)]
    found = {text.lstrip('-'): one for one in own for text in one.opts}
    return {key: one for below in inner for key, one in _options(below).items()} | found
