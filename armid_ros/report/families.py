# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters in the kinds that a reader compares with each other."""

from __future__ import annotations

from collections.abc import Sequence
import re

from armid_ros.effects import Effect
from armid_ros.estimate import ParameterName, symbol_in_words
from armid_ros.report.notation import pretty

#: A parameter of a rigid body, and the number of its link.
_SYMBOL = re.compile(r'\b(m[xyz]?|I[xyz]{2})(\d+)\b')


def parameter_families(names: tuple[ParameterName, ...]) -> dict[tuple[str, str], list[int]]:
    """
    Sort parameters into kinds that share an axis.

    Returns
    -------
    dict of (str, str) to list of int
        Heading and unit, and the positions of its parameters: the rigid ones by their unit, those
        of the effects by name and unit, which joints that slide and that turn do not share.

    """
    families: dict[tuple[str, str], list[int]] = {}
    kinds = {'kg m^2': 'Inertias', 'kg m': 'First moments', 'kg': 'Masses'}
    for position, name in enumerate(names):
        kind = kinds.get(name.unit) if name.rigid else None
        title = kind or name.name.replace('_', ' ').capitalize()
        families.setdefault((title, pretty(name.unit)), []).append(position)
    return families


def full_label(name: ParameterName, links: Sequence[str] = ()) -> str:
    """
    Return what a parameter is and of which link or joint, in words.

    Parameters
    ----------
    name : ParameterName
        Of a link, then with its number, or of an effect.
    links : sequence of str
        Names of the links in the order of their numbers; without them a link is that of its joint.

    Returns
    -------
    str
        'moment of inertia about z of forearm', with '(grouped)' where it is the first of several
        that no motion tells apart; or 'Coulomb torque of elbow'.

    """
    if name.rigid:
        label = rigid_label(name, links)
        return f'{label} (grouped)' if grouping(name) else label
    return f'{name.words} of {name.joint}' if name.joint else name.words


def rigid_label(name: ParameterName, links: Sequence[str] = ()) -> str:
    """Return the same of the first parameter of a group alone."""
    found = _SYMBOL.match(name.name)
    if found is None:
        return name.name
    symbol, number = found[1], int(found[2])
    known = 0 < number <= len(links)
    link = links[number - 1] if known else f'the link of {name.joint}'
    return f'{symbol_in_words(symbol)} of {link}'


def grouping(name: ParameterName, links: Sequence[str] = ()) -> str:
    """Return the sum that a group of parameters is, links by their names; '' for one alone."""
    if ' ' not in name.name:
        return ''

    def named(found: re.Match[str]) -> str:
        number = int(found[2])
        return f'{found[1]} of {links[number - 1]}' if 0 < number <= len(links) else found[0]

    return _SYMBOL.sub(named, name.name)


def effects_in_words(effects: Sequence[Effect]) -> str:
    """Return what effects are called, or that there are none."""
    return ', '.join(effect.name.replace('_', ' ') for effect in effects) or 'none'
