# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What certain data tell apart of an arm's parameters, and the bounds of that."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel
from armid_ros.identification.fitting.triangle import Triangle
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters, group_columns, regroup
from armid_ros.motion import FloatArray
import numpy as np

#: Parameters whose column the data separate from the others by less than this share are grouped
#: with them: 1e-4 of a column's length is far below what noise leaves of it.
EXCITATION_TOLERANCE = 1e-4


def excited(
    theory: BaseParameters, problem: Sequence[Regression]
) -> tuple[BaseParameters, tuple[Regression, ...]]:
    """
    Group further what a motion does not tell apart, such as the links of a joint at rest.

    Parameters
    ----------
    theory : BaseParameters
        What any motion can tell apart.
    problem : sequence of Regression
        The columns that theory keeps, along this motion.

    Returns
    -------
    base : BaseParameters
        What this motion tells apart.
    problem : tuple of Regression
        The columns of that.

    """
    base, kept = identifiable_base(theory, Triangle.of(problem))
    return base, tuple(part.restrict(kept) for part in problem)


def identifiable_base(
    theory: BaseParameters, triangle: Triangle
) -> tuple[BaseParameters, list[int]]:
    """
    Group further what the rows of a triangle do not tell apart.

    Parameters
    ----------
    theory : BaseParameters
        What any motion can tell apart.
    triangle : Triangle
        Rows in the columns that theory keeps.

    Returns
    -------
    base : BaseParameters
        What these rows tell apart.
    kept : list of int
        Which of the columns it keeps.

    """
    names = tuple(theory.standard[column] for column in theory.independent)
    data = group_columns(triangle.stacked, names, tolerance=EXCITATION_TOLERANCE)
    base = theory if data.rank == theory.rank else regroup(theory, data)
    order = {int(column): position for position, column in enumerate(theory.independent)}
    return base, [order[int(column)] for column in base.independent]


def bounds(arm: ArmModel, base: BaseParameters) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of base parameters; one that stands for a group has none."""
    free = np.full(len(arm.robot.rigid_parameters), np.inf)
    effects = [effect.bounds() for effect in arm.effects]
    lower = np.concatenate([-free, *(limits[0] for limits in effects)])[base.independent]
    upper = np.concatenate([free, *(limits[1] for limits in effects)])[base.independent]
    alone = np.count_nonzero(base.grouping, axis=1) == 1
    return np.where(alone, lower, -np.inf), np.where(alone, upper, np.inf)
