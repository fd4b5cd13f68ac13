# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the residual depends on: speed, position, load, and itself a while before."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification import Fit
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import (
    Cells,
    ContentSection,
    DataTable,
    Fold,
    Panels,
    Paragraph,
    TableCell,
)
from armid_ros.report.charts import Chart, Level, Series
from armid_ros.report.judgement import explained_shares, residual_by_variable, TELLING_SHARE
from armid_ros.report.statistics import Trend, Whiteness
from armid_ros.robots import Robot
import numpy as np

#: Points of a cloud; more of them hide each other.
_CLOUD = 500


def residual_section(robot: Robot, fits: Sequence[Fit], role: str) -> ContentSection:
    """
    Return the residual of each joint against its speed, its position and its load.

    Parameters
    ----------
    robot : Robot
        Gives joints and units.
    fits : sequence of Fit
        Held-out data where there are any.
    role : str
        'held-out' or 'training'.

    """
    shares = [list(explained_shares(fits, joint).values()) for joint in range(robot.n_joints)]
    most = [max(own, default=0.0) for own in shares]
    rows: list[Cells] = []
    folds = []
    for joint, name in enumerate(robot.joints):
        cells: Cells = [
            TableCell(f'{100 * share:.0f} %', 'telling' if share > TELLING_SHARE else '')
            for share in shares[joint]
        ]
        rows.append([name, *(cells or ('too few samples in motion', '', ''))])
        residual, axes = residual_by_variable(fits, joint)
        torque, length = robot.torque_units[joint], robot.position_units[joint]
        labels = (
            f'speed [{length}/s]',
            f'position [{length}]',
            f'load: predicted torque [{torque}]',
        )
        charts = [
            _cloud(x, residual, label, f'residual [{torque}]')
            for x, label in zip(axes.values(), labels, strict=True)
        ]
        opened = most[joint] == max(most) or most[joint] > TELLING_SHARE
        panels = Panels([('', '', [chart]) for chart in charts], three=True)
        folds.append(Fold(name, [panels], opened))
    return ContentSection(
        'Residual by variable',
        [
            Paragraph(
                f'Share of the {role} residual that one variable explains, beyond chance. Noise '
                'depends on none. Wrong friction depends on speed; wrong gravity or masses on '
                'position; gears and drives on load.'
            ),
            DataTable(('Joint', 'Speed', 'Position', 'Load'), rows),
            *folds,
            Paragraph('Dots: samples. Line: their mean in bins.', 'hint'),
        ],
    )


def _cloud(x: FloatArray, residual: FloatArray, xlabel: str, ylabel: str) -> Chart:
    """Draw a residual against a variable of the same samples, with its mean in bins."""
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


def whiteness_section(robot: Robot, fits: Sequence[Fit], role: str) -> ContentSection:
    """Return the autocorrelation of the residuals with the band of white noise."""
    panels = []
    for joint, name in enumerate(robot.joints):
        found = Whiteness.of(fits, joint)
        chart = Chart(
            found.lag,
            [Series('autocorrelation', found.correlation, 'residual', 'sticks')],
            'lag [s]',
            'autocorrelation',
            height=150,
            levels=[Level(found.band, '99 %'), Level(-found.band)],
            symmetric=True,
            legend=False,
        )
        panels.append((name, f'{100 * found.outside:.0f} % of the lags outside', [chart]))
    said = (
        f'Autocorrelation of the {role} residual. Of white noise 1 % of the lags lie outside the '
        'band; the filters colour the first lag or two.'
    )
    return ContentSection('Whiteness', [Paragraph(said), Panels(panels, three=True)])
