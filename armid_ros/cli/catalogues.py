# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is shipped and what can be named."""

from __future__ import annotations

from armid_ros.cli import options
from armid_ros.cli.terminal import print_rows
from armid_ros.effects import CATALOGUE
from armid_ros.robots import shipped_robots
import click


@click.command(epilog='Example: armid robots')
@options.as_json
def robots(as_json: bool) -> None:
    """List the robots that are shipped."""
    rows = [{'name': name, 'what it is': text} for name, text in shipped_robots().items()]
    print_rows(rows, as_json)


@click.command(epilog='Example: armid effects --json')
@options.as_json
def effects(as_json: bool) -> None:
    """List the effects that can be simulated and estimated."""
    rows = [
        {
            'name': name,
            'what it is': effect.summary,
            'parameters': [_with_unit(q.name, q.unit) for q in effect.quantities],
            **({'shapes': [_with_unit(s.name, s.unit) for s in effect.shapes]} if as_json else {}),
        }
        for name, effect in CATALOGUE.items()
    ]
    print_rows(rows, as_json)


def _with_unit(name: str, unit: str) -> str:
    return f'{name} [{unit}]' if unit else name
