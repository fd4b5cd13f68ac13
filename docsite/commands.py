# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation page of all commands, generated from their command-line parser."""

from __future__ import annotations

from collections.abc import Iterator
import inspect

from armid_ros.cli import main
import click

from docsite.markdown import cell, prose, table


def commands_page() -> str:
    """Return a Markdown page with usage, help and options of every armid command."""
    group = click.Context(main, info_name='armid', **main.context_settings)
    lines = [
        '# Commands',
        '',
        'This page lists the commands and options of `armid`. A command that did its job ends '
        'with exit code 0. A command with bad input prints one line on stderr and ends with exit '
        'code 2.',
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
    yield from table(('option', 'meaning'), rows)


def _names(option: str) -> str:
    """Return the names of an option as inline code, separated by commas."""
    return ', '.join(f'`{name}`' for name in option.replace(', -', '\n-').split('\n'))
