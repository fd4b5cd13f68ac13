# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters in the kinds that a reader compares with each other."""

from __future__ import annotations

from armid_ros.estimate import ParameterName
from armid_ros.report.notation import pretty


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


def short_label(name: ParameterName) -> str:
    """Return a label that fits an axis: the leading symbol of a grouping, or the joint."""
    if not name.rigid:
        return name.joint or name.name
    leader = name.name.split(' ')[0]
    return leader if leader == name.name else f'{leader} *'


def full_label(name: ParameterName) -> str:
    """Return a short label that says the kind as well: 'Izz1', 'Coulomb torque of elbow'."""
    if name.rigid:
        return name.name.split(' ')[0]
    kind = name.name.replace('_', ' ').replace('coulomb', 'Coulomb')
    return f'{kind} of {name.joint}' if name.joint else kind
