# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The documentation page of all effects in the catalogue."""

from __future__ import annotations

import inspect

from armid_ros.effects import CATALOGUE, Effect, Quantity

from docsite.markdown import cell, table


def effects_page() -> str:
    """Return a Markdown page with formula, source and parameters of each effect."""
    lines = [
        '# Effects',
        '',
        'This page lists the effects of the catalogue, which a diagnosis can name and `--effects` '
        'and `effects=` can select. Units are those of revolute joints; for prismatic joints, '
        'read N for N m and m for rad. You can [write an effect of your own]'
        '(../howto/own_effect.md).',
        '',
    ]
    for name, effect in CATALOGUE.items():
        lines += [f'## {name}', '', f'{effect.summary[0].upper()}{effect.summary[1:]}.', '']
        lines += ['```text', inspect.cleandoc(effect.__doc__ or '').strip(), '```', '']
        lines += table(
            ('parameter', 'unit', 'possible', 'usual for arms of 1 to 10 kg'), _rows(effect)
        )
    return '\n'.join(lines)


def _rows(effect: type[Effect]) -> list[tuple[str, ...]]:
    rows = [
        (f'`{one.name}`', cell(one.unit), _range(one.lower, one.upper), _usual(one))
        for one in effect.quantities
    ]
    return rows + [
        (f'`{one.name}` (shape)', cell(one.unit), _range(one.lower, one.upper), f'{one.default:g}')
        for one in effect.shapes
    ]


def _range(lower: float, upper: float) -> str:
    if lower == -upper == -float('inf'):
        return 'any'
    if upper == float('inf'):
        return f'from {lower:g}'
    return f'{lower:g} to {upper:g}'


def _usual(quantity: Quantity) -> str:
    if quantity.typical is None:
        return ''
    low, high = quantity.typical
    return f'{low:g} to {high:g}'
