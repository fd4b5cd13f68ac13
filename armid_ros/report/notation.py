# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Formats of numbers, units and names in reports and on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import PurePath
import re

from armid_ros.diagnosis.verdict import words
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.estimate import measured, ParameterName
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from markupsafe import escape, Markup

#: Text for a missing number.
DASH = '\N{EN DASH}'
#: Larger than all quantities of an arm in SI units.
_MAX_NUMBER = 1e12
#: Terms with a tooltip.
TERMS = {
    'usual error': 'Larger of the torque noise and the earlier model error of a joint.',
    'held out': 'Not used to fit the model.',
    'condition number': 'Ratio of best to worst excitation of parameters; below 100 is good.',
}


def pretty(unit: str) -> str:
    """Write the powers in a unit as superscripts: 'kg m²' for 'kg m^2'."""
    return unit.replace('^2', '²').replace('^3', '³')


def digits(value: float, count: int = 2) -> str:
    """Format a number with `count` significant digits, or more for a large integer part."""
    if not abs(value) < _MAX_NUMBER:
        return DASH
    if 10.0**count <= abs(value) < 1e7:
        return f'{value:.0f}'
    return f'{value:z#.{count}g}'.rstrip('.')


def plain(value: float, count: int = 3) -> str:
    """Format a number without trailing zeros; very small or large numbers have an exponent."""
    rounded = 10.0**count - 0.5 <= abs(value) < 1e7
    return f'{value:.0f}' if rounded else f'{value:.{count}g}'


def sentence(text: str) -> str:
    """Capitalise the first letter of a text, and end it with a full stop."""
    text = text[:1].upper() + text[1:]
    return text if text.endswith('?') else f'{text.rstrip(".")}.'


def with_interval(value: float, std: float, unit: str) -> str:
    """Format a value with its 95 % interval and unit; angles in degrees as well."""
    text = _plus_minus(value, std, f' {pretty(unit)}'.rstrip())
    if unit == 'rad' and abs(value) < _MAX_NUMBER:
        turn = 180.0 / math.pi
        text += f' ({_plus_minus(turn * value, turn * std, "°")})'
    return text


def value_of(
    finding: Finding, parameter: ParameterName, value: float, std: float, had: float = 0.0
) -> str:
    """Format a parameter of a finding with its interval, or return 'not determined'."""
    if words.vague(finding, parameter, value, std):
        return 'not determined'
    start = f'{measured(had, HALF_WIDTH * std)[0]} to ' if had else ''
    return start + with_interval(had + value, std, parameter.unit)


def _plus_minus(value: float, std: float, unit: str) -> str:
    """Format a value with its 95 % interval: '2.00 ± 0.01 kg'."""
    if not abs(value) < _MAX_NUMBER:
        return DASH
    wide = HALF_WIDTH * std
    if not 0.0 < wide < _MAX_NUMBER:
        return f'{value:.4g}{unit}'
    centre, half = measured(value, wide)
    return f'{centre} ± {half}{unit}'


def percent(share: float) -> str:
    """Format a share as a percentage: '96 %', '0.4 %'."""
    if not math.isfinite(share):
        return DASH
    return words.percent(share)


def probability(p: float) -> str:
    """Format a p-value: '0.25', '0.03' or '< 0.0001'."""
    if p < 1e-4:
        return '< 0.0001'
    return f'{p:.1g}' if p < 0.1 else f'{p:.2f}'


def counted(number: int, noun: str) -> str:
    """Format a number with its noun, in the plural if needed: '1 joint', '2 joints'."""
    return f'{number} {noun if number == 1 else noun + "s"}'


def robot_label(source: str) -> str:
    """Return the name of a robot for headings: shipped name or file name."""
    if source == '-':
        return 'description in the recording'
    path = source.split(' ')[0] if ':=' in source else source
    return PurePath(path).name or path


def common_prefix(names: Sequence[str]) -> str:
    """
    Return the prefix that all joint and link names share, such as 'panda_', or ''.

    Parameters
    ----------
    names : sequence of str
        Joints and links.

    Returns
    -------
    str
        Five letters or more and a separator, after which each name goes on with a letter; or ''.

    """
    first = names[0] if len(names) > 1 else ''
    ends = [first[: found.end()] for found in re.finditer(r'[_/.:-]', first)]
    fitting = [
        end
        for end in ends
        # shortest prefix that is omitted from names [letters]
        if len(end) > 5 and all(x.startswith(end) and x[len(end) :][:1].isalpha() for x in names)
    ]
    return max(fitting, default='')


def explained(text: str) -> Markup:
    """Convert a text to HTML; the first use of each of the `TERMS` gets a tooltip."""
    html = str(escape(text))
    for term, meaning in TERMS.items():
        words = rf'(?<!>)\b({term.replace(" ", "[ -]")})\b'
        html = re.sub(words, rf'<abbr title="{meaning}">\1</abbr>', html, count=1, flags=re.I)
    return Markup(html)
