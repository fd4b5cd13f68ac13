# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How an online estimate converges."""

from __future__ import annotations

import textwrap

from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray
from armid_ros.report.families import parameter_families
from armid_ros.report.figures.parameters import HALF_WIDTH
from armid_ros.report.figures.style import (
    COLOURS,
    FAINT,
    legend,
    MEASURED,
    new_figure,
    plain,
    PREDICTED,
    RESIDUAL,
)
from armid_ros.report.notation import pretty
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
import numpy as np
import numpy.typing as npt

_PANELS = 6
_COLUMNS = 3


def convergence_figure(
    t: npt.ArrayLike,
    values: npt.ArrayLike,
    std: npt.ArrayLike,
    truth: npt.ArrayLike,
    parameters: tuple[ParameterName, ...],
    *,
    truth_label: str = 'truth',
) -> Figure:
    """
    Draw how an online estimate comes to the truth.

    The best known parameters of each kind in their own units; below, all of them, each error as a
    share of the largest parameter of its kind on its joint.

    Parameters
    ----------
    t : array_like, shape (K,)
        Time since the start [s].
    values, std : array_like, shape (K, P)
        Estimates and their standard deviations.
    truth : array_like, shape (P,)
        What they should come to.
    parameters : tuple of ParameterName
        P names.
    truth_label : str
        What the truth is: 'truth', 'offline estimate'.

    """
    time, series, spread, target = (np.asarray(x, dtype=float) for x in (t, values, std, truth))
    chosen = _telling(parameters, target, spread[-1])
    rows = -(-len(chosen) // _COLUMNS)
    figure = new_figure(0.6 + 1.65 * rows + 2.5)
    grid = figure.add_gridspec(rows + 1, _COLUMNS, height_ratios=[1.65] * rows + [2.5])
    for place, number in enumerate(chosen):
        axes = figure.add_subplot(grid[place // _COLUMNS, place % _COLUMNS])
        _draw_one(axes, time, series[:, number], spread[:, number], target[number], truth_label)
        plain(axes, _title(parameters[number]), ylabel=pretty(parameters[number].unit))
        if place == 0:
            legend(figure, axes)
    everything = figure.add_subplot(grid[rows, :])
    scale = _scale(parameters, target)
    _draw_all(everything, time, np.abs(series - target) / scale, HALF_WIDTH * spread / scale)
    plain(
        everything,
        f'All {len(parameters)} parameters',
        xlabel='time [s]',
        ylabel='error, share of the largest\nparameter of its kind on its joint',
    )
    return figure


def _title(name: ParameterName) -> str:
    """Return a parameter's name in at most two lines."""
    text = name.name
    if not name.rigid:
        text = f'{text.replace("_", " ").capitalize()}, {name.joint}'
    return textwrap.fill(textwrap.shorten(text, 44, placeholder=' ...'), 24)


def _telling(
    parameters: tuple[ParameterName, ...], truth: FloatArray, std: FloatArray
) -> list[int]:
    """Choose parameters to show one by one: the best known of each kind, kinds in turn."""
    certainty = np.abs(truth) / np.maximum(std, 1e-300)
    queues = [
        sorted(members, key=lambda k: -certainty[k])
        for members in parameter_families(parameters).values()
    ]
    chosen: list[int] = []
    for turn in range(max(map(len, queues))):
        chosen += [queue[turn] for queue in queues if turn < len(queue)]
    return sorted(chosen[:_PANELS])


def _draw_one(
    axes: Axes,
    t: FloatArray,
    values: FloatArray,
    std: FloatArray,
    truth: float,
    truth_label: str,
) -> None:
    reach = HALF_WIDTH * std
    axes.fill_between(
        t,
        values - reach,
        values + reach,
        color=RESIDUAL,
        alpha=0.2,
        linewidth=0,
        label='95 % interval',
    )
    axes.plot(t, values, color=RESIDUAL, linewidth=1.3, label='online estimate')
    axes.axhline(truth, color=MEASURED, linewidth=1.0, linestyle=(0, (4, 2)), label=truth_label)
    late = slice(len(t) // 5, None)
    span = max(float(np.max(np.abs(values[late] - truth) + reach[late])), 0.25 * abs(truth), 1e-12)
    axes.set_ylim(truth - 1.1 * span, truth + 1.1 * span)
    axes.set_xlim(t[0], t[-1])


def _draw_all(axes: Axes, t: FloatArray, error: FloatArray, reach: FloatArray) -> None:
    axes.plot(t, np.maximum(error, 1e-6), color=FAINT, linewidth=0.5, alpha=0.7)
    axes.plot([], [], color=FAINT, linewidth=1.0, label='each parameter')
    middle = np.median(error, axis=1)
    axes.plot(t, middle, color=PREDICTED, linewidth=2.0, label='median error')
    axes.plot(
        t,
        np.median(reach, axis=1),
        color=COLOURS[0],
        linewidth=1.5,
        linestyle=(0, (4, 2)),
        label='median 95 % half-width, as the estimator believes',
    )
    axes.set_yscale('log')
    late = slice(len(t) // 20, None)
    axes.set_ylim(max(1e-5, 0.5 * np.quantile(error[late], 0.03)), 3.0 * error[late].max())
    axes.set_xlim(t[0], t[-1])
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f'{100.0 * y:g} %'))
    axes.legend(loc='lower right', bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False, fontsize=8.0)


def _scale(parameters: tuple[ParameterName, ...], truth: FloatArray) -> FloatArray:
    """Return the largest parameter of the same kind on the same joint, for each parameter."""
    scale = np.abs(truth)
    for members in parameter_families(parameters).values():
        for joint in {parameters[k].joint for k in members}:
            same = [k for k in members if parameters[k].joint == joint]
            scale[same] = np.abs(truth[same]).max()
    return np.where(scale > 0.0, scale, 1.0)
