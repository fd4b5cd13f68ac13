# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters with their intervals against what they should be."""

from __future__ import annotations

from typing import Any

from armid_ros.estimate import Estimate
from armid_ros.identification.assess.agreement import Agreement
from armid_ros.motion import FloatArray
from armid_ros.report.families import parameter_families, short_label
from armid_ros.report.figures.style import (
    legend,
    MEASURED,
    new_figure,
    plain,
    PREDICTED,
    RESIDUAL,
)
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator
import numpy as np
import numpy.typing as npt

#: Half width of a 95 % interval in standard deviations.
HALF_WIDTH = 1.96
_COLUMNS = 3


def parameter_figure(
    estimate: Estimate, reference: npt.ArrayLike, *, reference_label: str = 'truth'
) -> Figure:
    """
    Draw every parameter with its 95 % interval, and the value it is compared with.

    Parameters
    ----------
    estimate : Estimate
        P parameters.
    reference : array_like, shape (P,)
        Values to compare with.
    reference_label : str
        What they are: 'truth', 'description'.

    """
    target = np.asarray(reference, dtype=float)
    families = parameter_families(estimate.parameters)
    columns = _balanced([len(members) for members in families.values()])
    tallest = max(sum(len(list(families.values())[k]) + 3 for k in column) for column in columns)
    figure = new_figure(1.05 + 0.145 * tallest)
    outer = figure.add_gridspec(1, len(columns))
    names = list(families)
    axes = None
    for position, column in enumerate(columns):
        ratios = [len(families[names[k]]) + 1 for k in column]
        inner = outer[position].subgridspec(len(column), 1, height_ratios=ratios)
        for row, number in enumerate(column):
            axes = figure.add_subplot(inner[row])
            members = families[names[number]]
            kind, unit = names[number]
            plain(axes, kind, xlabel=unit)
            _draw(axes, estimate, target, members)
            axes.grid(False, axis='y')
    assert axes is not None
    axes.errorbar([], [], xerr=[], **_marks(RESIDUAL), label='estimate, 95 % interval')
    axes.errorbar(
        [], [], xerr=[], **_marks(PREDICTED), label=f'... that leaves out the {reference_label}'
    )
    axes.plot([], [], '|', color=MEASURED, markersize=9, label=reference_label)
    legend(figure, axes)
    inside = np.count_nonzero(_contains(estimate, target))
    together = Agreement.of(estimate, target)
    figure.supxlabel(
        f'{inside} of {len(target)} intervals contain the {reference_label}, '
        f'{0.95 * len(target):.0f} expected; errors of correlated parameters come together.\n'
        f'Squared distance of all parameters from the {reference_label}: '
        f'{together.distance:.0f}; in 95 of 100 experiments {together.lower:.0f} to '
        f'{together.upper:.0f}.\n*: the first of a group that no motion tells apart',
        fontsize=8.0,
    )
    return figure


def _contains(estimate: Estimate, target: FloatArray) -> npt.NDArray[np.bool_]:
    return np.asarray(np.abs(estimate.values - target) <= HALF_WIDTH * estimate.std)


def _marks(colour: str) -> dict[str, Any]:
    return {'fmt': 'o', 'color': colour, 'markersize': 3.2, 'elinewidth': 1.2, 'capsize': 1.8}


def _draw(axes: Axes, estimate: Estimate, target: FloatArray, members: list[int]) -> None:
    rows = np.arange(len(members))
    inside = _contains(estimate, target)[members]
    values, reach = estimate.values[members], HALF_WIDTH * estimate.std[members]
    axes.plot(target[members], rows, '|', color=MEASURED, markersize=9, markeredgewidth=1.6)
    for chosen, colour in ((inside, RESIDUAL), (~inside, PREDICTED)):
        axes.errorbar(values[chosen], rows[chosen], xerr=reach[chosen], **_marks(colour))
    labels = [short_label(estimate.parameters[member]) for member in members]
    axes.set_yticks(rows, labels)
    axes.set_ylim(len(members) - 0.4, -0.6)
    if np.abs(values).max() > 12.0 * np.median(np.abs(values) + reach):
        _signed_log(axes, float(np.quantile(reach, 0.25)))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.axvline(0.0, color='#cccccc', linewidth=0.8, zorder=0)


def _signed_log(axes: Axes, near_zero: float) -> None:
    """Make the axis logarithmic either side of a linear stretch as wide as the intervals."""
    linear = 10.0 ** float(np.ceil(np.log10(near_zero)))
    axes.set_xscale('symlog', linthresh=linear, linscale=0.8)
    axes.margins(x=0.06)
    lowest, highest = axes.get_xlim()
    place = axes.xaxis.get_transform().transform
    apart = 0.19 * float(place(highest) - place(lowest))
    ticks = [0.0]
    for end in (lowest, highest):
        last = 0.0
        for power in range(round(np.log10(linear)), int(np.log10(max(abs(end), 1e-300))) + 1):
            tick = float(np.sign(end)) * 10.0**power
            if lowest <= tick <= highest and abs(place(tick) - place(last)) >= apart:
                ticks.append(tick)
                last = tick
    axes.xaxis.set_major_locator(FixedLocator(sorted(ticks)))
    axes.xaxis.set_minor_locator(NullLocator())
    exponent = f'$10^{{{round(np.log10(linear))}}}$'
    axes.set_xlabel(f'{axes.get_xlabel()} (log beyond ± {exponent})')


def _balanced(sizes: list[int]) -> list[list[int]]:
    """Fill columns of similar height in order of reading; return the families of each."""
    columns: list[list[int]] = [[] for _ in range(min(_COLUMNS, len(sizes)))]
    heights = [0] * len(columns)
    for number in sorted(range(len(sizes)), key=lambda k: -sizes[k]):
        column = heights.index(min(heights))
        columns[column].append(number)
        heights[column] += sizes[number] + 3
    return sorted(sorted(column) for column in columns)
