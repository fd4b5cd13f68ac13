# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What an excitation does, and what it will show."""

from __future__ import annotations

from armid_ros.excitation import Excitation, Information
from armid_ros.motion import FloatArray
from armid_ros.report.families import parameter_families, short_label
from armid_ros.report.figures.style import (
    COLOURS,
    LIMIT,
    new_figure,
    plain,
    PREDICTED,
    RESIDUAL,
)
from armid_ros.report.notation import position_unit
from armid_ros.robots import CollisionModel, Robot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.ticker import FuncFormatter
import numpy as np

_POINTS = 400
_COLUMNS = 3
_LABELLED = 4


def excitation_figure(
    robot: Robot,
    excitation: Excitation,
    *,
    collision: CollisionModel | None = None,
    margin: float = 0.0,
    information: Information | None = None,
) -> Figure:
    """
    Draw the joints' paths against their limits, the clearance, and what the run will tell.

    Parameters
    ----------
    robot : Robot
        Gives limits and units.
    excitation : Excitation
        The run.
    collision : CollisionModel, optional
        Bodies whose clearance is drawn.
    margin : float
        Clearance that was to be kept [m].
    information : Information, optional
        What the run tells about the parameters.

    """
    rows = -(-robot.n_joints // _COLUMNS)
    extra = [2.0] * (collision is not None) + [2.6] * (information is not None)
    figure = new_figure(0.3 + 1.7 * rows + sum(extra))
    grid = figure.add_gridspec(rows + len(extra), _COLUMNS, height_ratios=[1.7] * rows + extra)
    t = np.linspace(0.0, excitation.duration, _POINTS)
    q = excitation.at(t).q
    _draw_paths(figure, grid, robot, t, q)
    if collision is not None:
        axes = figure.add_subplot(grid[rows, :])
        _draw_clearance(axes, t, collision.path_clearance(q), margin)
    if information is not None:
        _draw_information(figure.add_subplot(grid[rows + len(extra) - 1, :]), information)
    return figure


def _draw_paths(
    figure: Figure, grid: GridSpec, robot: Robot, t: FloatArray, q: FloatArray
) -> None:
    for joint, name in enumerate(robot.joints):
        axes = figure.add_subplot(grid[joint // _COLUMNS, joint % _COLUMNS])
        lower, upper = robot.lower[joint], robot.upper[joint]
        bottom, top = q[:, joint].min(), q[:, joint].max()
        if np.isfinite(upper - lower):
            bottom, top = min(bottom, lower), max(top, upper)
        room = 0.1 * (top - bottom) or 1.0
        for limit, edge in ((lower, bottom - room), (upper, top + room)):
            if np.isfinite(limit):
                axes.axhspan(*sorted((limit, edge)), color=LIMIT, linewidth=0)
                axes.axhline(limit, color=PREDICTED, linewidth=0.8)
        axes.plot(t, q[:, joint], color=RESIDUAL, linewidth=1.2)
        axes.set_xlim(t[0], t[-1])
        axes.set_ylim(bottom - room, top + room)
        last = joint >= robot.n_joints - _COLUMNS
        plain(
            axes,
            name,
            xlabel='time [s]' if last else '',
            ylabel=f'position [{position_unit(robot, joint)}]' if joint % _COLUMNS == 0 else '',
        )
        axes.grid(False, axis='y')
        if joint == 0 and np.isfinite(upper):
            axes.annotate(
                'limit', (t[-1], upper), (-2, 1), textcoords='offset points', fontsize=7.5,
                ha='right', va='bottom', color='#a04000',
            )  # fmt: skip


def _draw_clearance(axes: Axes, t: FloatArray, clearance: FloatArray, margin: float) -> None:
    axes.plot(t, 100.0 * clearance, color=RESIDUAL, linewidth=1.2)
    top = 110.0 * float(clearance.max())
    bottom = min(0.0, 110.0 * float(clearance.min()))
    axes.axhspan(bottom, 100.0 * margin, color=LIMIT, linewidth=0)
    if margin > 0.0:
        axes.axhline(100.0 * margin, color=PREDICTED, linewidth=0.8)
    worst = int(np.argmin(clearance))
    axes.plot(t[worst], 100.0 * clearance[worst], 'o', color=RESIDUAL, markersize=4)
    axes.set_ylim(bottom, top)
    axes.set_xlim(t[0], t[-1])
    plain(
        axes,
        f'Clearance between bodies: never less than {100.0 * clearance[worst]:.1f} cm'
        + (f' ({100.0 * margin:g} cm asked for)' if margin > 0.0 else ''),
        xlabel='time [s]',
        ylabel='clearance [cm]',
    )
    axes.grid(False, axis='y')


def _draw_information(axes: Axes, information: Information) -> None:
    """Draw the predicted deviations as torque, in units of the torque noise, kind by kind."""
    size = information.std / information.scale
    order: list[int] = []
    for number, (title, members) in enumerate(parameter_families(information.parameters).items()):
        ranked = sorted(members, key=lambda k: size[k])
        seen = [k for k in ranked if np.isfinite(size[k])]
        x = len(order) + np.arange(len(seen))
        colour = COLOURS[number % len(COLOURS)]
        axes.vlines(x, 1e-9, size[seen], color=colour, linewidth=1.0, alpha=0.5)
        axes.plot(x, size[seen], 'o', color=colour, markersize=3.5, label=title)
        order += [*seen, -1]
    place = {k: position for position, k in enumerate(order) if k >= 0}
    worst = sorted(place, key=lambda k: -size[k])[:_LABELLED]
    for k in worst:
        name = information.parameters[k]
        above = 4 + 10 * sum(0 < place[other] - place[k] < 4 for other in worst)
        axes.annotate(
            short_label(name), (place[k], size[k]), (0, above), textcoords='offset points',
            fontsize=7.5, ha='center',
        )  # fmt: skip
    axes.set_yscale('log')
    finite = size[np.isfinite(size)]
    axes.set_ylim(0.6 * finite.min(), 4.0 * finite.max())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f'{100.0 * y:g} %'))
    axes.set_xlim(-1, len(order))
    unseen = len(size) - len(finite)
    plain(
        axes,
        f'What remains uncertain of {len(size)} parameters'
        + (f'; {unseen} will not be seen at all' if unseen else ''),
        ylabel='torque left uncertain, as a share\nof the noise of one sample',
    )
    axes.set_xticks([])
    axes.grid(False, axis='x')
    axes.legend(
        loc='upper center', bbox_to_anchor=(0.5, -0.02), ncols=6, frameon=False, fontsize=8.0
    )
