# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the identification of elastic joints found: responses, steps, parameters."""

from __future__ import annotations

from typing import Any

from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.papers.elastic.identification import (
    ideal_response,
    MeasuredJoint,
    TwoInertiaIdentification,
)
from armid_ros.papers.elastic.identification.names import unpack
from armid_ros.papers.elastic.identification.tuning import Tuning
from armid_ros.report.figures.style import (
    COLOURS,
    legend,
    MEASURED,
    new_figure,
    plain,
    PREDICTED,
    RESIDUAL,
)
from armid_ros.robots.two_link import TwoLinkParameters
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
import numpy as np

_BAND = (2.0, 100.0)
_LABELS = {
    'alpha': r'$\alpha$',
    'beta': r'$\beta$',
    'gamma': r'$\gamma$',
    'motor_inertia': 'mm',
    'stiffness': 'kg',
    'link_damping': 'dl',
    'motor_damping': 'dm',
    'spring_damping': 'dg',
}


def bode_figure(result: TwoInertiaIdentification) -> Figure:
    """
    Draw the responses of both joints from motor torque to motor velocity, size and phase.

    Measured with the other link's motion as a second input (decoupled) and without (coupled), the
    decoupled joint as identified by subspaces, and that of the physical parameters found.

    """
    figure = new_figure(5.4)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.6, 1.0])
    parameters = result.parameters
    for joint, measured in enumerate(result.measured):
        size = figure.add_subplot(grid[0, joint])
        phase = figure.add_subplot(grid[1, joint], sharex=size)
        frequency = np.geomspace(*_BAND, 400)
        curves = (
            (measured.frequency, measured.coupled[:, 0], 'measured, motor torque alone'),
            (measured.frequency, measured.decoupled[:, 0], 'measured, decoupled'),
            (
                frequency,
                result.joints[joint].system.response(frequency)[:, 0, 0],
                'subspaces, order 3',
            ),
            (
                frequency,
                ideal_response(parameters, joint, frequency)[:, 0, 0],
                'physical parameters',
            ),
        )
        styles: tuple[dict[str, Any], ...] = (
            {'color': COLOURS[3], 'linewidth': 1.0},
            {'color': MEASURED, 'linestyle': 'none', 'marker': 'o', 'markersize': 2.4},
            {'color': RESIDUAL, 'linewidth': 2.4, 'alpha': 0.6},
            {'color': PREDICTED, 'linewidth': 1.1, 'linestyle': (0, (4, 2))},
        )
        for (f, response, label), style in zip(curves, styles, strict=True):
            shown = (f >= _BAND[0]) & (f <= _BAND[1])
            size.plot(f[shown], 20.0 * np.log10(np.abs(response[shown])), label=label, **style)
            angle = np.degrees(np.angle(response[shown]))
            phase.plot(f[shown], angle, **style)
        _mark(size, result, joint)
        _frequency_axis(size, phase, measured, joint)
        if joint == 0:
            legend(figure, size, columns=4)
    return figure


def _mark(axes: Axes, result: TwoInertiaIdentification, joint: int) -> None:
    """Mark antiresonance and resonance, with their frequencies at the foot."""
    parameters = result.parameters
    inertia, rotor = parameters.inertia[joint], parameters.rotor[joint]
    stiffness = parameters.stiffness[joint]
    for squared, words, side in (
        (stiffness / inertia, 'antiresonance', 'right'),
        (stiffness * (1.0 / inertia + 1.0 / rotor), 'resonance', 'left'),
    ):
        place = float(np.sqrt(squared) / (2.0 * np.pi))
        axes.axvline(place, color='#bbbbbb', linewidth=0.8, zorder=0)
        axes.annotate(
            f'{words}\n{place:.1f} Hz', (place, 0.02), xycoords=axes.get_xaxis_transform(),
            xytext=(-3 if side == 'right' else 3, 0), textcoords='offset points', fontsize=7.0,
            ha=side, va='bottom', color='#555555',
        )  # fmt: skip


def _frequency_axis(size: Axes, phase: Axes, measured: MeasuredJoint, joint: int) -> None:
    first = joint == 0
    plain(size, measured.joint, ylabel='motor velocity / torque\n[dB re rad/(N m s)]' * first)
    plain(phase, xlabel='frequency [Hz]', ylabel='phase [deg]' * first)
    size.set_xscale('log')
    size.set_xlim(*_BAND)
    size.tick_params(labelbottom=False)
    phase.set_ylim(-100.0, 100.0)
    phase.set_yticks([-90, 0, 90])
    phase.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f'{x:g}'))
    phase.xaxis.set_minor_formatter(NullFormatter())
    phase.set_xticks([2, 5, 10, 20, 50, 100])
    size.margins(y=0.12)


def step_figure(tuning: Tuning) -> Figure:
    """Draw the links' velocities of the step experiments: measured, before and after tuning."""
    experiments = tuning.measured.shape[1]
    figure = new_figure(0.6 + 1.6 * experiments)
    grid = figure.add_gridspec(experiments, 2)
    t = 1e3 * tuning.steps.dt * np.arange(len(tuning.measured))
    for experiment in range(experiments):
        for joint in range(2):
            axes = figure.add_subplot(grid[experiment, joint])
            column = 2 + joint
            axes.plot(
                t, tuning.measured[:, experiment, column], color=MEASURED, linewidth=2.2,
                alpha=0.45, label='measured',
            )  # fmt: skip
            for values, colour, dashes, label in (
                (tuning.before, RESIDUAL, (0, (4, 2)), 'before tuning'),
                (tuning.after, PREDICTED, '-', 'after tuning'),
            ):
                axes.plot(
                    t, values[:, experiment, column], color=colour, linewidth=1.0,
                    linestyle=dashes, label=label,
                )  # fmt: skip
            axes.plot(
                t, tuning.steps.reference[:, experiment, joint], color='#999999', linewidth=0.7,
                label='asked for',
            )  # fmt: skip
            pose = np.degrees(tuning.steps.q[experiment, 1])
            plain(
                axes,
                f'link {joint + 1}, joint 2 at {pose:.0f}°',
                xlabel='time [ms]' if experiment == experiments - 1 else '',
                ylabel='velocity [rad/s]' if joint == 0 else '',
            )
            axes.set_xlim(t[0], t[-1])
            if experiment == joint == 0:
                legend(figure, axes)
    return figure


def comparison_figure(result: TwoInertiaIdentification, reference: TwoLinkParameters) -> Figure:
    """
    Draw the parameters as shares of a reference, with 95 % intervals where they were tuned.

    Parameters
    ----------
    result : TwoInertiaIdentification
        What was found.
    reference : TwoLinkParameters
        What it is compared with, such as a printed set.

    """
    figure = new_figure(3.4)
    axes = figure.add_subplot()
    names = _short_names()
    base = unpack(reference)
    rows = np.arange(len(base))
    axes.axvline(0.0, color=MEASURED, linewidth=1.0, label='reference')
    early = 100.0 * (unpack(result.untuned) / base - 1.0)
    axes.plot(early, rows - 0.16, 'D', color=RESIDUAL, markersize=3.4, label='after step 3a')
    if result.tuning is not None:
        estimate = result.tuning.estimate
        found = 100.0 * (estimate.values / base - 1.0)
        reach = 100.0 * HALF_WIDTH * estimate.std / base
        axes.errorbar(
            found, rows + 0.16, xerr=reach, fmt='o', color=PREDICTED, markersize=3.4,
            elinewidth=1.2, capsize=1.8, label='tuned, 95 % interval',
        )  # fmt: skip
    axes.set_yticks(rows, names)
    axes.invert_yaxis()
    axes.set_xscale('symlog', linthresh=1.0, linscale=1.0)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f'{x:g}'))
    plain(axes, xlabel='difference from the reference [%] (log beyond ± 1 %)')
    axes.grid(False, axis='y')
    legend(figure, axes)
    return figure


def _short_names() -> list[str]:
    rigid = list(_LABELS.values())[:3]
    return rigid + [f'{label}{j}' for label in list(_LABELS.values())[3:] for j in (1, 2)]
