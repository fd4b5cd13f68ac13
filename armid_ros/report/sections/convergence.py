# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convergence of an online estimate."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import ContentSection, Panels, Paragraph
from armid_ros.report.charts import Chart, Series
from armid_ros.report.families import full_label, parameter_families
from armid_ros.report.notation import pretty
import numpy as np


def convergence_section(
    history: Sequence[tuple[float, Estimate]], truth: FloatArray
) -> ContentSection:
    """
    Return online estimates over time with their 95 % intervals and the true values.

    Parameters
    ----------
    history : sequence of (float, Estimate)
        Times since the start [s], and estimates of P parameters.
    truth : ndarray, shape (P,)
        True values.

    """
    t, parameters = np.array([at for at, _ in history]), history[-1][1].parameters
    values = np.array([estimate.values for _, estimate in history])
    std = np.array([estimate.std for _, estimate in history])
    certainty = np.abs(truth) / np.maximum(std[-1], 1e-300)
    kinds = [
        sorted(members, key=lambda k: -certainty[k])
        for members in parameter_families(parameters).values()
    ]
    longest = max(map(len, kinds))
    turns = [kind[turn] for turn in range(longest) for kind in kinds if turn < len(kind)]
    panels = []
    for k in sorted(turns[:6]):
        reach = HALF_WIDTH * std[:, k]
        known = np.isfinite(reach) & (reach < 3.0 * (abs(truth[k]) + reach[-1]))
        lower, upper, drawn = (
            np.where(known, x, np.nan)
            for x in (values[:, k] - reach, values[:, k] + reach, values[:, k])
        )
        chart = Chart(
            t,
            [
                Series('95 % interval', lower, 'floor', 'band', upper),
                Series('online estimate', drawn, 'residual'),
            ],
            'time [s]',
            f'estimate [{pretty(parameters[k].unit)}]',
            height=170,
            link='convergence',
            levels=[(float(truth[k]), 'truth')],
            legend=False,
        )
        panels.append((full_label(parameters[k]), '', [chart]))
    said = (
        'Six parameters over time, the best-determined one of each kind first. The band is the '
        '95 % interval of the online estimate; the line is the true value.'
    )
    title = 'Convergence of the online estimate'
    return ContentSection(title, [Paragraph(said), Panels(panels, three=True)])
