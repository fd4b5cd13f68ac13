# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Parameters that given data determine, their bounds, and the reasons for undetermined ones.

Parameters that a motion does not separate are grouped into base parameters. Parameters that the
data determine worse than the description keep their described values. The mean squared error of an
unbiased estimate is its variance; that of a described value is its largest expected error squared.
For example, if joints move one after the other, the columns that couple joints are small. Their
parameters would fit noise.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from armid_ros.arm import ArmModel
from armid_ros.estimate import ParameterName
from armid_ros.identification.fitting.least_squares import (
    factored,
    Method,
    NormalEquations,
    Solution,
    solve,
)
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters, group_columns, regroup
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Reason for a parameter that more motion of its joint would identify.
NOT_SHOWN: Literal['this motion does not show it'] = 'this motion does not show it'

#: Half width of a 95 % interval in standard deviations.
HALF_WIDTH = 1.96

Reason = Literal[
    'no motion of this arm shows it',
    'this motion does not show it',
    'this motion shows it only together with others',
    'not distinguishable from zero',
]


@dataclass(frozen=True)
class Unidentified:
    """
    Parameter that the data do not identify.

    Attributes
    ----------
    parameter : ParameterName
        A standard parameter, or a base parameter.
    reason : str
        Reason, one of `Reason`.

    """

    parameter: ParameterName
    reason: Reason


def excludes_zero(values: npt.ArrayLike, std: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Return for each estimate whether its 95 % confidence interval excludes zero."""
    return np.asarray(np.abs(values) > HALF_WIDTH * np.asarray(std, dtype=float))


def excited(
    theory: BaseParameters, problem: Sequence[Regression]
) -> tuple[BaseParameters, tuple[Regression, ...]]:
    """
    Group parameters that a motion does not separate; return base parameters and their columns.

    Parameters
    ----------
    theory : BaseParameters
        Base parameters that are identifiable in some motion.
    problem : sequence of Regression
        Columns of `theory` along this motion.

    Returns
    -------
    base : BaseParameters
        Base parameters that are identifiable in this motion.
    problem : tuple of Regression
        Columns of `base`.

    """
    base, kept = identifiable_base(theory, NormalEquations.of(problem))
    return base, tuple(part.restrict(kept) for part in problem)


def identifiable_base(
    theory: BaseParameters, normal: NormalEquations
) -> tuple[BaseParameters, list[int]]:
    """
    Group parameters that normal equations do not separate; return base and column indices.

    Parameters
    ----------
    theory : BaseParameters
        Base parameters that are identifiable in some motion.
    normal : NormalEquations
        Normal equations in the columns of `theory`.

    Returns
    -------
    base : BaseParameters
        Base parameters that the normal equations identify.
    kept : list of int
        Indices of the columns of `base` among those of `theory`.

    """
    names = tuple(theory.standard[column] for column in theory.independent)
    rows, _ = factored(normal.summed()[:-1, :-1])
    # share of a column that is independent of the others, below which its parameter is grouped
    # with them: 1e-4 of the length of a column is far below the noise
    data = group_columns(rows, names, tolerance=1e-4)
    base = theory if data.rank == theory.rank else regroup(theory, data)
    order = {int(column): position for position, column in enumerate(theory.independent)}
    return base, [order[int(column)] for column in base.independent]


def bounds(arm: ArmModel, base: BaseParameters) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds of base parameters, (r,), infinite for grouped parameters."""
    free = np.full(len(arm.robot.rigid_parameters), np.inf)
    effects = [effect.bounds() for effect in arm.effects]
    lower = np.concatenate([-free, *(limits[0] for limits in effects)])[base.independent]
    upper = np.concatenate([free, *(limits[1] for limits in effects)])[base.independent]
    alone = np.count_nonzero(base.grouping, axis=1) == 1
    return np.where(alone, lower, -np.inf), np.where(alone, upper, np.inf)


def fit_determined(
    arm: ArmModel, base: BaseParameters, problem: Sequence[Regression], method: Method
) -> tuple[BaseParameters, tuple[Regression, ...], Solution]:
    """
    Fit the base parameters that the data determine better than the description does.

    Parameters are fixed one at a time, as each fixed parameter makes the others more certain.

    Parameters
    ----------
    arm : ArmModel
        Arm as described.
    base : BaseParameters
        Base parameters that the data identify.
    problem : sequence of Regression
        Columns of `base`.
    method : {'ols', 'wls', 'irls'}
        Weights of the fit; see ``solve``.

    Returns
    -------
    base : BaseParameters
        Base parameters that are fitted.
    problem : tuple of Regression
        Columns of the fitted parameters, with the torque of fixed parameters as a constant.
    solution : Solution
        Solution of the returned problem.

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
        problem = tuple(
            replace(
                part.restrict(kept), constant=part.constant + part.columns[:, :, worst] * value
            )
            for part in problem
        )
        base = replace(
            base,
            parameters=tuple(base.parameters[k] for k in kept),
            independent=base.independent[kept],
            grouping=base.grouping[kept],
        )
        spread = spread[kept]
    return base, problem, solution


def base_spread(arm: ArmModel, base: BaseParameters) -> FloatArray:
    """
    Return the largest expected error of each base parameter in the description, shape (r,).

    The error is infinite for an effect of unknown size, and if no link has a mass.

    """
    effects = [effect.spread(arm.robot) for effect in arm.effects]
    spread = np.concatenate([arm.robot.described_spread.ravel(), *effects])
    unknown = np.any(base.grouping[:, ~np.isfinite(spread)], axis=1)
    known = np.where(np.isfinite(spread), spread, 0.0)
    size = np.linalg.norm(base.grouping * known, axis=1)
    return np.where(~unknown & (size > 0.0), size, np.inf)


def near_deviation(robot: Robot) -> FloatArray:
    """Return the prior standard deviations of described inertial parameters, shape (10 n,)."""
    return np.asarray(robot.described_spread.ravel() / np.sqrt(3.0))
