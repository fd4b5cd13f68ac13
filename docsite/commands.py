# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page of all commands, from the parser that reads the command line."""

from __future__ import annotations

from collections.abc import Iterator
import inspect

from armid_ros.cli import main
import click

from docsite.markdown import cell, prose, table


def commands_page() -> str:
    """Return the page: usage, text and options of every command, in the order of the work."""
    group = click.Context(main, info_name='armid', **main.context_settings)
    lines = [
        '# Commands',
        '',
        'Made from the parser of `armid` itself. A command ends with code 0 when the job was '
        'done, with 2 and one line on stderr when its input is bad.',
        '',
    ]
    for name in main.list_commands(group):
        command = main.get_command(group, name)
        assert command is not None
        lines += _command(command, click.Context(command, info_name=name, parent=group))
    return '\n'.join(lines)


def _command(command: click.Command, context: click.Context) -> Iterator[str]:
    yield from (f'## {context.command_path}', '', prose(command.help or ''), '')
    usage = ' '.join([context.command_path, *command.collect_usage_pieces(context)])
    yield from ('```text', usage, '```', '')
    if command.epilog:
        title, _, example = inspect.cleandoc(command.epilog).partition(': ')
        yield from (f'{title}:', '', '```text', example, '```', '')
    options = (p for p in command.get_params(context) if isinstance(p, click.Option))
    records = (option.get_help_record(context) for option in options)
    rows = [(_names(option), cell(text)) for option, text in filter(None, records)]
    yield from table(('option', 'what it does'), rows)


def _names(option: str) -> str:
    """Return the names of an option, each a piece that is not broken."""
    return ', '.join(f'`{name}`' for name in option.replace(', -', '\n-').split('\n'))
