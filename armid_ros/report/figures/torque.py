# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Measured against predicted torque."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.identification import Fit, Score
from armid_ros.motion import FloatArray
from armid_ros.report.figures.style import (
    BROAD,
    FAINT,
    legend,
    new_figure,
    plain,
    PREDICTED,
    RESIDUAL,
)
from armid_ros.report.notation import digits, torque_unit
from armid_ros.robots import Robot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
import numpy as np
import numpy.typing as npt

_REST = '#e4e4e4'


def torque_figure(robot: Robot, fits: Sequence[Fit], *, title: str = '') -> Figure:
    """
    Draw measured against predicted torque of every joint, with the residual below.

    Parameters
    ----------
    robot : Robot
        Gives units.
    fits : sequence of Fit
        Stretches of one recording, in order of time.
    title : str
        What is shown, such as 'Held-out run'.

    """
    joints = fits[0].motion.joints
    columns = 2 if len(joints) > 1 else 1
    rows = -(-len(joints) // columns)
    figure = new_figure(0.7 + 2.05 * rows)
    grid = figure.add_gridspec(2 * rows, columns, height_ratios=(3, 1) * rows)
    score = Score.of(fits)
    for joint, name in enumerate(joints):
        row, column = divmod(joint, columns)
        torque = figure.add_subplot(grid[2 * row, column])
        residual = figure.add_subplot(grid[2 * row + 1, column], sharex=torque)
        _draw(torque, residual, fits, joint)
        unit = torque_unit(robot, joint)
        percent = score.joint_relative_error_percent[joint]
        plain(torque, name, ylabel=f'torque [{unit}]' if unit == 'N m' else f'force [{unit}]')
        torque.set_title(
            f'residual {digits(score.rms[joint])} {unit} rms, {digits(percent)} %',
            fontsize=8.0,
            loc='right',
        )
        torque.tick_params(labelbottom=False)
        last = joint >= len(joints) - columns
        plain(residual, xlabel='time [s]' if last else '', ylabel='residual')
        if joint == 0:
            first = torque
            torque.plot([], [], color=RESIDUAL, linewidth=1.0, label='measured - predicted')
    if not all(fit.informative.all() for fit in fits):
        label = 'at rest: does not count'
        first.fill_between([], [], color=_REST, linewidth=0, label=label)
    legend(figure, first, columns=4)
    if title:
        figure.suptitle(title, fontsize=10.5, fontweight='bold')
    return figure


def _draw(torque: Axes, residual: Axes, fits: Sequence[Fit], joint: int) -> None:
    for number, fit in enumerate(fits):
        t, tau = fit.motion.t, fit.motion.tau
        assert tau is not None
        names = ('measured', 'predicted by the model') if number == 0 else ('', '')
        torque.plot(t, tau[:, joint], color=BROAD, linewidth=2.6, label=names[0])
        counts = fit.informative[:, joint]
        predicted = np.where(counts, fit.predicted[:, joint], np.nan)
        torque.plot(t, predicted, color=PREDICTED, linewidth=1.0, label=names[1])
        residual.plot(t, np.where(counts, fit.residual[:, joint], np.nan), color=RESIDUAL, lw=0.8)
        for start, stop in _rests(t, fit.informative[:, joint]):
            for axes in (torque, residual):
                axes.axvspan(start, stop, color=_REST, linewidth=0, zorder=0)
    residual.axhline(0.0, color=FAINT, linewidth=0.8, zorder=1)
    counted = [np.abs(fit.residual * fit.informative)[:, joint].max() for fit in fits]
    limit = 1.15 * max(max(counted), 1e-12)
    residual.set_ylim(-limit, limit)
    residual.yaxis.set_major_locator(MaxNLocator(3, symmetric=True))
    residual.set_xlim(fits[0].motion.t[0], fits[-1].motion.t[-1])


def _rests(t: FloatArray, informative: npt.NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Return the stretches of time in which friction holds the joint."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], ~informative, [0]]).astype(int)))
    return [(t[start], t[stop - 1]) for start, stop in edges.reshape(-1, 2)]
