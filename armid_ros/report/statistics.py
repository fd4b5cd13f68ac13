# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Statistics of torque residuals: trends, autocorrelation, and their sections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armid_ros.identification import Fit, Identification
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import Cells, DataTable, Fold, Panels, Paragraph, TableCell
from armid_ros.report.charts import Chart, Series
from armid_ros.report.page import Section
from armid_ros.robots import Robot
import numpy as np

#: Share of a joint's residual explained by one variable, above which the trend is reported.
MIN_TREND_SHARE = 0.15
#: Smallest number of samples for a trend.
_MIN_SAMPLES = 20


@dataclass(frozen=True)
class Trend:
    """
    Mean residual of a joint in bins of another quantity, such as speed.

    Attributes
    ----------
    x, residual : ndarray, shape (N,)
        The other quantity, and the residual.
    centre, mean : ndarray, shape (B,)
        Mean abscissa and mean residual of each bin, equally many samples in each.
    share : float
        Share of the residual's variance that the means explain, 0 to 1; 0 for too few samples.

    """

    x: FloatArray
    residual: FloatArray
    centre: FloatArray
    mean: FloatArray
    share: float

    @staticmethod
    def of(x: FloatArray, residual: FloatArray, bins: int = 20) -> Trend:
        """Return the mean of a residual, shape (N,), in bins of a quantity x, shape (N,)."""
        if len(x) == 0:
            return Trend(x, residual, x, x, 0.0)
        groups = np.array_split(np.argsort(x, kind='stable'), max(1, min(bins, len(x) // 25)))
        centre = np.array([x[group].mean() for group in groups])
        mean = np.array([residual[group].mean() for group in groups])
        sizes = np.array([len(group) for group in groups])
        total = float(np.sum((residual - residual.mean()) ** 2))
        between = float(np.sum(sizes * (mean - residual.mean()) ** 2))
        share = between / total if total > 0.0 and len(x) >= _MIN_SAMPLES else 0.0
        return Trend(x, residual, centre, mean, share)


@dataclass(frozen=True)
class Whiteness:
    """
    Autocorrelation of a joint's residual, with the 99 % band of white noise.

    Attributes
    ----------
    lag : ndarray, shape (L,)
        Lags from one sample on [s].
    correlation : ndarray, shape (L,)
        Autocorrelation at each lag.
    band : float
        Half width of the band in which 99 % of the lags of white noise lie.

    """

    lag: FloatArray
    correlation: FloatArray
    band: float

    @property
    def outside(self) -> float:
        """Share of lags with autocorrelation outside the 99 % band; white noise has 0.01."""
        return float(np.mean(np.abs(self.correlation) > self.band))

    @staticmethod
    def of(fits: Sequence[Fit], joint: int, lags: int = 40) -> Whiteness:
        """Compute the autocorrelation of a joint's residual within gap-free sections."""
        longest = max(fits, key=lambda fit: len(fit.motion)).motion
        period = float(np.median(np.diff(longest.t)))
        products = np.zeros(max(2, min(lags + 1, len(longest) // 4)))
        count = 0
        for fit in fits:
            residual = np.where(fit.informative[:, joint], fit.residual[:, joint], 0.0)
            residual = residual - residual.mean()
            count += int(fit.informative[:, joint].sum())
            for lag in range(len(products)):
                products[lag] += residual[lag:] @ residual[: max(0, len(residual) - lag)]
        correlation = products[1:] / max(float(products[0]), 1e-300)
        lag_times = np.asarray(period * np.arange(1, len(products)))
        # two-sided 99 % point of the normal distribution
        return Whiteness(lag_times, correlation, 2.576 / np.sqrt(max(count, 1)))


def torque_reach(result: Identification, fits: Sequence[Fit]) -> FloatArray:
    """
    Return the 95 % half-width of each joint's predicted torque due to parameter errors, (n,).

    The half-widths are root mean squares over a motion [N m].

    """
    motion = max(fits, key=lambda fit: len(fit.motion)).motion
    # number of samples of the longest stretch for the mean variance of the torque
    chosen = np.unique(np.linspace(0, len(motion) - 1, 300).astype(np.intp))
    columns = result.arm.columns(motion.select(chosen))[:, :, result.base.independent]
    variance = np.sum((columns @ result.estimate.covariance) * columns, axis=2)
    return np.asarray(HALF_WIDTH * np.sqrt(variance.mean(axis=0)))


def residual_section(robot: Robot, fits: Sequence[Fit], role: str) -> Section:
    """
    Return the section with each joint's residual over speed, position and load.

    Parameters
    ----------
    robot : Robot
        Joints and units.
    fits : sequence of Fit
        Fits of the held-out data; without such data, those of the training data.
    role : str
        'held-out' or 'training'.

    """
    trends = [trends_of(fits, joint) for joint in range(robot.n_joints)]
    most = [max(trend.share for trend in own.values()) for own in trends]
    rows: list[Cells] = []
    folds = []
    for joint in np.argsort(-np.array(most), kind='stable'):
        name, own = robot.joints[joint], trends[joint].values()
        cells: Cells = [
            TableCell(
                f'{100 * trend.share:.0f} %', 'telling' if trend.share > MIN_TREND_SHARE else ''
            )
            for trend in own
        ]
        few = len(trends[joint]['speed'].x) < _MIN_SAMPLES
        rows.append([name, *(('too few samples in motion', '', '') if few else cells)])
        torque, length = robot.torque_units[joint], robot.position_units[joint]
        labels = (
            f'speed [{length}/s]',
            f'position [{length}]',
            f'load: predicted torque [{torque}]',
        )
        charts = [
            _cloud(trend, label, f'residual [{torque}]')
            for trend, label in zip(own, labels, strict=True)
        ]
        opened = most[joint] == max(most) or most[joint] > MIN_TREND_SHARE
        panels = Panels([('', '', [chart]) for chart in charts], three=True)
        folds.append(Fold(name, [panels], opened))
    return Section(
        'Residual by variable',
        [
            Paragraph(
                f'Share of the {role} residual that one variable explains, the '
                'worst joint first. Noise depends on none. Wrong friction depends on speed; wrong '
                'gravity or masses on position; gears and drives on load.'
            ),
            DataTable(('Joint', 'Speed', 'Position', 'Load'), rows),
            *folds,
            Paragraph('Dots: samples. Line: their mean in bins.', 'hint'),
        ],
    )


def _cloud(trend: Trend, xlabel: str, ylabel: str) -> Chart:
    """Return a chart of a residual against a variable, with the mean residual in bins."""
    x, residual = trend.x, trend.residual
    # largest number of points of a cloud
    chosen = np.unique(np.linspace(0, max(len(x) - 1, 0), min(500, len(x))).astype(np.intp))
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


def whiteness_section(robot: Robot, fits: Sequence[Fit], role: str) -> Section:
    """Return the section with the autocorrelation of each joint's residual."""
    panels = []
    for joint, name in enumerate(robot.joints):
        found = Whiteness.of(fits, joint)
        chart = Chart(
            found.lag,
            [Series('autocorrelation', found.correlation, 'residual', 'sticks')],
            'lag [s]',
            'autocorrelation',
            height=150,
            levels=[(found.band, '99 %'), (-found.band, '')],
            symmetric=True,
            legend=False,
        )
        panels.append((name, f'{100 * found.outside:.0f} % of the lags outside', [chart]))
    text = (
        f'Autocorrelation of the {role} residual. For white noise, 1 % of the lags are outside '
        'the band; the filters correlate the first one or two lags.'
    )
    return Section('Whiteness', [Paragraph(text), Panels(panels, three=True)])


def trends_of(fits: Sequence[Fit], joint: int) -> dict[str, Trend]:
    """Return the trend of a joint's residual with its speed, position and predicted torque."""
    used = np.concatenate([fit.informative[:, joint] for fit in fits])
    parts = {
        'speed': [fit.motion.dq for fit in fits],
        'position': [fit.motion.q for fit in fits],
        'load': [fit.predicted for fit in fits],
    }
    residual = np.concatenate([fit.residual[:, joint] for fit in fits])[used]
    return {
        key: Trend.of(np.concatenate(own)[used, joint], residual) for key, own in parts.items()
    }
