# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What certain data determine of an arm's parameters, and the bounds of that.

What a motion does not tell apart is grouped. What data determine worse than the description does
stays as described: the mean squared error of an estimate without bias is its variance, that of the
description what it may be off by. Where joints are moved one after the other, a column that other
joints make is small and not a part of others: a value that is fitted to it is what noise makes it.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects.load import described_spread
from armid_ros.identification.fitting.least_squares import Method, Solution, solve
from armid_ros.identification.fitting.normal_equations import factored, NormalEquations
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters, group_columns, regroup
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

#: Parameters whose column the data separate from the others by less than this share are grouped
#: with them: 1e-4 of a column's length is far below what noise leaves of it.
EXCITATION_TOLERANCE = 1e-4


def excited(
    theory: BaseParameters, problem: Sequence[Regression]
) -> tuple[BaseParameters, tuple[Regression, ...]]:
    """
    Group parameters that a motion does not separate, such as links of a joint at rest.

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
    base, kept = identifiable_base(theory, NormalEquations.of(problem))
    return base, tuple(part.restrict(kept) for part in problem)


def identifiable_base(
    theory: BaseParameters, normal: NormalEquations
) -> tuple[BaseParameters, list[int]]:
    """
    Group parameters that normal equations do not separate.

    Parameters
    ----------
    theory : BaseParameters
        What any motion can tell apart.
    normal : NormalEquations
        Rows in the columns that theory keeps.

    Returns
    -------
    base : BaseParameters
        What these rows tell apart.
    kept : list of int
        Which of the columns it keeps.

    """
    names = tuple(theory.standard[column] for column in theory.independent)
    rows, _ = factored(normal.summed()[:-1, :-1])
    data = group_columns(rows, names, tolerance=EXCITATION_TOLERANCE)
    base = theory if data.rank == theory.rank else regroup(theory, data)
    order = {int(column): position for position, column in enumerate(theory.independent)}
    return base, [order[int(column)] for column in base.independent]


def bounds(arm: ArmModel, base: BaseParameters) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of base parameters; a group of parameters has none."""
    free = np.full(len(arm.robot.rigid_parameters), np.inf)
    effects = [effect.bounds() for effect in arm.effects]
    lower = np.concatenate([-free, *(limits[0] for limits in effects)])[base.independent]
    upper = np.concatenate([free, *(limits[1] for limits in effects)])[base.independent]
    alone = np.count_nonzero(base.grouping, axis=1) == 1
    return np.where(alone, lower, -np.inf), np.where(alone, upper, np.inf)


def determined(
    arm: ArmModel, base: BaseParameters, problem: Sequence[Regression], method: Method
) -> tuple[BaseParameters, tuple[Regression, ...], Solution]:
    """
    Hold parameters at the description if it is more certain than the data.

    The others get surer by what is held, so that one is held at a time.

    Parameters
    ----------
    arm : ArmModel
        The description.
    base : BaseParameters
        What the data tell apart.
    problem : sequence of Regression
        Its columns.
    method : {'ols', 'wls', 'irls'}
        Of the fit.

    Returns
    -------
    base : BaseParameters
        What the data determine.
    problem : tuple of Regression
        Its columns, and the torque of what is held as a constant.
    solution : Solution
        Of the problem.

    """
    problem = tuple(problem)
    spread = base_spread(arm, base)
    while True:
        solution = solve(problem, method, bounds(arm, base))
        if not base.rank:
            break
        std = np.sqrt(np.diag(solution.covariance))
        worst = int(np.argmax(std / spread))
        if std[worst] <= spread[worst]:
            break
        kept = np.delete(np.arange(base.rank), worst)
        value = float(base.values(arm.theta)[worst])
        torques = [part.columns[:, :, worst] * value for part in problem]
        problem = tuple(
            replace(part, constant=torque + (0.0 if part.constant is None else part.constant))
            for part, torque in zip(problem, torques, strict=True)
        )
        problem = tuple(part.restrict(kept) for part in problem)
        parameters = tuple(base.parameters[k] for k in kept)
        base = replace(
            base,
            parameters=parameters,
            independent=base.independent[kept],
            grouping=base.grouping[kept],
        )
        spread = spread[kept]
    return base, problem, solution


def base_spread(arm: ArmModel, base: BaseParameters) -> FloatArray:
    """
    Return the largest expected errors of described base parameters, shape (r,).

    Infinite where an effect takes part that does not know the size of its values, and where no
    link has a mass.

    """
    effects = [effect.spread(arm.robot) for effect in arm.effects]
    spread = np.concatenate([described_spread(arm.robot).ravel(), *effects])
    unknown = np.any(base.grouping[:, ~np.isfinite(spread)], axis=1)
    known = np.where(np.isfinite(spread), spread, 0.0)
    size = np.linalg.norm(base.grouping * known, axis=1)
    return np.where(~unknown & (size > 0.0), size, np.inf)


def near_deviation(robot: Robot) -> FloatArray:
    """Return the prior standard deviation of rigid parameters, shape (10 n,)."""
    return np.asarray(described_spread(robot).ravel() / np.sqrt(3.0))
