# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Options of a project: what armid.toml of the current folder gives where no option is typed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import tomllib
from typing import Any

from armid_ros.errors import ArmidError, meant
from armid_ros.files import read_text
import click

FILE = 'armid.toml'


def project_options(name: str, command: click.Command, typed: Sequence[str]) -> dict[str, Any]:
    """
    Return defaults of a command by the names of its parameters, and print on stderr what they are.

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

    Raises
    ------
    ArmidError
        If the file is no TOML, or the table of the command has a key that is none of its options.

    """
    if isinstance(command, click.Group):
        below = next((word for word in typed if word in command.commands), '')
        inner = command.commands.get(below)
        return {below: project_options(f'{name} {below}', inner, typed)} if inner else {}
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
    options = {
        text.lstrip('-'): one
        for one in command.params
        if isinstance(one, click.Option)
        for text in one.opts
    }
    for key in own.keys() - options.keys():
        raise ArmidError(f"{FILE}: armid {name} has no option '{key}'{meant(key, options)}")
    words = {text.split('=')[0] for text in typed}
    found = {}
    for key, value in given.items():
        option = options.get(key)
        if option is None or option.name is None or words & {*option.opts, *option.secondary_opts}:
            continue
        listed = isinstance(value, list) and not option.multiple
        found[option.name] = ','.join(map(str, value)) if listed else value
        click.echo(f'{FILE}: --{key} {found[option.name]}', err=True)
    return found
