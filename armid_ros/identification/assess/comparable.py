# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which two files can be compared: two results, of one robot, that share a parameter."""

from __future__ import annotations

from armid_ros.errors import ModelError
from armid_ros.identification.parameters_file import ParameterFile


def require_comparable(before: ParameterFile, after: ParameterFile) -> None:
    """
    Refuse two robots, and one result that is given twice.

    Raises
    ------
    ModelError
        Naming both files.

    """
    _require_one_robot(before, after)
    _require_two(before, after)


def nothing_shared(before: ParameterFile, after: ParameterFile) -> str:
    """Say why two files cannot be compared."""
    for one in (before, after):
        if not one.values and one.without_std:
            return (
                f'{one.source} has no standard deviation of any parameter, so no change can be '
                'told from chance; name a result of identify'
            )
    return (
        f'{before.source} and {after.source} have no identified parameter in common; '
        'are they of one robot, in one gravity?'
    )


def _require_one_robot(before: ParameterFile, after: ParameterFile) -> None:
    """Refuse robots whose joints differ, wherever their files are."""
    known = before.kinematics and after.kinematics
    if not known or before.kinematics == after.kinematics:
        return
    apart = set(before.joints).symmetric_difference(after.joints)
    how = (
        f'only one of them has {", ".join(sorted(apart))}'
        if apart
        else ('their joints are of the same names, and in other places')
    )
    raise ModelError(
        f'{before.source} and {after.source} are of different robots, {before.robot} and '
        f'{after.robot}: {how}; what changed can be said of one robot only'
    )


def _require_two(before: ParameterFile, after: ParameterFile) -> None:
    """Refuse one result that is given twice, under one name or two."""
    same = before.values == after.values and before.without_std == after.without_std
    if same and (before.values or before.without_std):
        copy = '' if before.source == after.source else f' (is {before.source})'
        raise ModelError(
            f'given twice: {after.source}{copy}; name two results, of recordings of their own'
        )
