# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What two identifications do not have in common, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from armid_ros.estimate import ParameterName
from armid_ros.identification.parameters_file import ParameterFile

#: 'deviation': a file has no standard deviation of it, or of what it groups. 'motion': the other
#: motion does not show it. 'effect': the other model has no such effect there. 'grouping': the
#: other data do not tell the links apart in this way.
Why = Literal['deviation', 'motion', 'effect', 'grouping']


@dataclass(frozen=True)
class NotCompared:
    """
    A parameter that is not compared.

    Attributes
    ----------
    parameter : ParameterName
        Which.
    why : {'deviation', 'motion', 'effect', 'grouping'}
        What stands against it.

    """

    parameter: ParameterName
    why: Why

    def document(self) -> dict[str, str]:
        """Return it for programs to read."""
        return {'name': self.parameter.name, 'joint': self.parameter.joint, 'why': self.why}


def only_in(one: ParameterFile, other: ParameterFile) -> tuple[NotCompared, ...]:
    """Return what one has of its own, where the other has no value of it."""
    return tuple(
        NotCompared(name, _why(name, other))
        for name in one.values
        if name not in other.values and name not in other.without_std
    )


def without_deviation(before: ParameterFile, after: ParameterFile) -> tuple[NotCompared, ...]:
    """Return what one of them has without a standard deviation."""
    names = dict.fromkeys((*before.without_std, *after.without_std))
    return tuple(NotCompared(name, 'deviation') for name in names)


def _why(name: ParameterName, other: ParameterFile) -> Why:
    if (name.name, name.joint) in other.not_shown:
        return 'motion'
    if not name.rigid:
        return 'effect'
    return 'deviation' if other.without_std else 'grouping'
