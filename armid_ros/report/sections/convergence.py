# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convergence of an online estimate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.estimate import ParameterName
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.report.charts import Chart, Level, Series
from armid_ros.report.families import full_label, parameter_families
from armid_ros.report.notation import pretty
from armid_ros.report.page import Section
import numpy as np

#: Parameters that are drawn.
_SHOWN = 6


@dataclass(frozen=True)
class Convergence(Section):
    """
    Online estimates over time with their 95 % intervals and the true values.

    Attributes
    ----------
    t : ndarray, shape (K,)
        Time since the start [s].
    values, std : ndarray, shape (K, P)
        Estimates and their standard deviations.
    truth : ndarray, shape (P,)
        True values.
    parameters : tuple of ParameterName
        P names.

    """

    title: ClassVar[str] = 'Convergence of the online estimate'
    template: ClassVar[str] = 'convergence.html'

    t: FloatArray
    values: FloatArray
    std: FloatArray
    truth: FloatArray
    parameters: tuple[ParameterName, ...]

    @property
    def shown(self) -> list[int]:
        """Parameters that are drawn: the best known of each kind, kinds in turn."""
        certainty = np.abs(self.truth) / np.maximum(self.std[-1], 1e-300)
        kinds = [
            sorted(members, key=lambda k: -certainty[k])
            for members in parameter_families(self.parameters).values()
        ]
        longest = max(map(len, kinds))
        turns = [kind[turn] for turn in range(longest) for kind in kinds if turn < len(kind)]
        return sorted(turns[:_SHOWN])

    @property
    def charts(self) -> list[tuple[str, Chart]]:
        """Label of each parameter that is drawn, and its curve."""
        return [(full_label(self.parameters[k]), self._chart(k)) for k in self.shown]

    def _chart(self, k: int) -> Chart:
        values, reach = self.values[:, k], HALF_WIDTH * self.std[:, k]
        known = np.isfinite(reach) & (reach < 3.0 * (abs(self.truth[k]) + reach[-1]))
        lower, upper, drawn = (
            np.where(known, x, np.nan) for x in (values - reach, values + reach, values)
        )
        return Chart(
            self.t,
            [
                Series('95 % interval', lower, 'floor', 'band', upper),
                Series('online estimate', drawn, 'residual'),
            ],
            'time [s]',
            f'estimate [{pretty(self.parameters[k].unit)}]',
            height=170,
            link='convergence',
            levels=[Level(float(self.truth[k]), 'truth')],
            legend=False,
        )
