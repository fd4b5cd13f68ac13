# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the residual goes with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification import Fit
from armid_ros.motion import FloatArray
from armid_ros.report.charts import Chart, Series
from armid_ros.report.judgement import explained_shares, TELLING_SHARE
from armid_ros.report.notation import position_unit, torque_unit
from armid_ros.report.page import Section
from armid_ros.report.statistics import Trend
from armid_ros.robots import Robot
import numpy as np

#: Points of a cloud; more of them hide each other.
_CLOUD = 500


@dataclass(frozen=True)
class JointResidualView:
    """The residual of one joint against its speed, its position and its load."""

    name: str
    shares: Sequence[tuple[str, float]]
    charts: Sequence[Chart]

    @property
    def worst(self) -> float:
        """Largest share of the residual that one variable explains."""
        return max((share for _, share in self.shares), default=0.0)


@dataclass(frozen=True)
class Residuals(Section):
    """
    The residual against what could explain it.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    fits : sequence of Fit
        Held-out data where there are any.
    role : str
        'held-out' or 'training'.

    """

    title: ClassVar[str] = 'Residual by variable'
    template: ClassVar[str] = 'residuals.html'
    telling: ClassVar[float] = TELLING_SHARE

    robot: Robot
    fits: Sequence[Fit]
    role: str

    @property
    def joints(self) -> list[JointResidualView]:
        """Every joint, in the order of the robot."""
        return [self._joint(joint) for joint in range(self.robot.n_joints)]

    def _joint(self, joint: int) -> JointResidualView:
        used = np.concatenate([fit.informative[:, joint] for fit in self.fits])
        residual = np.concatenate([fit.residual[:, joint] for fit in self.fits])[used]
        torque = torque_unit(self.robot, joint)
        length = position_unit(self.robot, joint)
        axes = (
            ([fit.motion.dq[:, joint] for fit in self.fits], f'speed [{length}/s]'),
            ([fit.motion.q[:, joint] for fit in self.fits], f'position [{length}]'),
            ([fit.predicted[:, joint] for fit in self.fits], f'load: predicted torque [{torque}]'),
        )
        charts = [
            cloud(np.concatenate(parts)[used], residual, xlabel, f'residual [{torque}]')
            for parts, xlabel in axes
        ]
        shares = explained_shares(self.fits, joint)
        return JointResidualView(self.robot.joints[joint], tuple(shares.items()), charts)


def cloud(x: FloatArray, residual: FloatArray, xlabel: str, ylabel: str) -> Chart:
    """
    Draw a residual against a variable, with its mean in bins.

    Parameters
    ----------
    x, residual : ndarray, shape (N,)
        Variable and residual of the same samples.
    xlabel, ylabel : str
        Axes with units.

    """
    trend = Trend.of(x, residual)
    chosen = np.unique(np.linspace(0, max(len(x) - 1, 0), min(_CLOUD, len(x))).astype(np.intp))
    abscissa = np.concatenate([x[chosen], trend.centre])
    points = np.concatenate([residual[chosen], np.full(len(trend.centre), np.nan)])
    means = np.concatenate([np.full(len(chosen), np.nan), trend.mean])
    order = np.argsort(abscissa, kind='stable')
    return Chart(
        abscissa[order],
        [
            Series('residual', points[order], 'residual', 'points'),
            Series('mean', means[order], 'trend', 'trend'),
        ],
        xlabel,
        ylabel,
        height=190,
        symmetric=True,
        legend=False,
    )
