# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What data determine worse than the description of an arm does: it stays as described.

The mean squared error of an estimate without bias is its variance, that of the description what
it may be off by. Where joints are moved one after the other, a column that other joints make is
small, of its own and not a part of others: a value that is fitted to it is off by as much as noise
makes it, and predicts a motion that shows it by far too much.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects.load import described_spread
from armid_ros.identification.fitting.excited import bounds
from armid_ros.identification.fitting.least_squares import Method, solve
from armid_ros.identification.rows.regression import Regression
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
import numpy as np


def determined(
    arm: ArmModel, base: BaseParameters, problem: Sequence[Regression], method: Method
) -> tuple[BaseParameters, tuple[Regression, ...]]:
    """
    Hold at the description what is less sure than it, the least sure first.

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

    """
    problem = tuple(problem)
    spread = base_spread(arm, base)
    while base.rank:
        std = np.sqrt(np.diag(solve(problem, method, bounds(arm, base)).covariance))
        worst = int(np.argmax(std / spread))
        if std[worst] <= spread[worst]:
            break
        kept = np.delete(np.arange(base.rank), worst)
        value = float(base.values(arm.theta)[worst])
        problem = tuple(_held(part, worst, value).restrict(kept) for part in problem)
        parameters = tuple(base.parameters[k] for k in kept)
        base = replace(
            base,
            parameters=parameters,
            independent=base.independent[kept],
            grouping=base.grouping[kept],
        )
        spread = spread[kept]
    return base, problem


def base_spread(arm: ArmModel, base: BaseParameters) -> FloatArray:
    """
    Return what base parameters of a description may be off by, shape (r,).

    Infinite where an effect takes part that does not know the size of its values, and where no
    link has a mass.

    """
    effects = [effect.spread(arm.robot) for effect in arm.effects]
    spread = np.concatenate([described_spread(arm.robot).ravel(), *effects])
    unknown = np.any(base.grouping[:, ~np.isfinite(spread)], axis=1)
    known = np.where(np.isfinite(spread), spread, 0.0)
    size = np.linalg.norm(base.grouping * known, axis=1)
    return np.where(~unknown & (size > 0.0), size, np.inf)


def _held(part: Regression, column: int, value: float) -> Regression:
    """Return a problem with the torque of one column at a value in its constant."""
    torque = part.columns[:, :, column] * value
    return replace(part, constant=torque if part.constant is None else part.constant + torque)
