# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Figures for documents show what they are given, with names and units."""

from dataclasses import replace
from pathlib import Path
import subprocess
import sys

from armid_ros.identification.assess.agreement import FREEDOM
from armid_ros.report.figures import (
    convergence_figure,
    parameter_figure,
    save_figure,
    torque_figure,
)
import matplotlib
import numpy as np
import pytest
import scipy.stats


def texts(figure):
    """Return everything that is written in a figure."""
    figure.canvas.draw()
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text)]


def drawn(axes):
    """Return the data of all curves."""
    return [np.asarray(line.get_ydata(), dtype=float) for line in axes.lines]


def test_torque_figure_draws_measured_predicted_and_residual_of_every_joint(case):
    (fits,) = case.validation.values()
    figure = torque_figure(case.description.robot, fits)
    assert len(figure.axes) == 2 * len(fits[0].motion.joints)
    for joint, name in enumerate(fits[0].motion.joints):
        torque, residual = (
            axes
            for axes in figure.axes
            if axes.get_shared_x_axes().joined(axes, figure.axes[2 * joint])
        )
        assert torque.get_title(loc='left') == name
        assert torque.get_ylabel() == 'torque [N m]'
        measured, predicted = drawn(torque)[:2]
        np.testing.assert_array_equal(measured, fits[0].motion.tau[:, joint])
        np.testing.assert_array_equal(drawn(residual)[0], measured - predicted)


def test_parameter_figure_counts_the_intervals_that_contain_the_reference(case):
    estimate = case.result.estimate
    reference = estimate.values + 1.9 * estimate.std
    reference[:3] += 0.2 * estimate.std[:3]
    written = texts(parameter_figure(estimate, reference))
    count = len(reference)
    assert any(f'{count - 3} of {count} intervals contain the truth' in text for text in written)
    assert {'kg m²', 'N m', 'elbow_pitch'} <= {text.split(' (')[0] for text in written}


def test_parameter_figure_has_a_bar_for_every_parameter(case):
    estimate = case.result.estimate
    figure = parameter_figure(estimate, estimate.values)
    ticks = [tick for axes in figure.axes for tick in axes.get_yticks()]
    assert len(ticks) == len(estimate.parameters)


def test_convergence_figure_shows_all_parameters_and_says_the_unit(case):
    estimate = case.result.estimate
    t = np.linspace(0.5, 10.0, 50)
    std = estimate.std * np.sqrt(10.0 / t)[:, np.newaxis]
    figure = convergence_figure(
        t, estimate.values + std, std, estimate.values, estimate.parameters
    )
    written = texts(figure)
    assert f'All {len(estimate.parameters)} parameters' in written
    assert 'kg m²' in written and 'time [s]' in written
    assert figure.axes[-1].get_yscale() == 'log'


@pytest.mark.parametrize('suffix', ['.png', '.svg', '.pdf'])
def test_figures_are_saved_without_a_display(case, tmp_path, suffix):
    path = tmp_path / f'figure{suffix}'
    save_figure(parameter_figure(case.result.estimate, case.result.estimate.values), path)
    assert path.stat().st_size > 5000


def test_figures_need_no_global_state():
    code = 'import armid_ros.report.figures, sys; sys.exit("matplotlib.pyplot" in sys.modules)'
    subprocess.run([sys.executable, '-c', code], check=True, cwd=Path(__file__).parents[2])


def test_what_is_grey_in_a_torque_figure_is_explained_and_has_no_residual(case):
    (fits,) = case.validation.values()
    informative = np.array(fits[0].informative)
    informative[20:60, 2] = False
    predicted = np.array(fits[0].predicted)
    predicted[40, 2] += 1e3
    figure = torque_figure(
        case.description.robot, [replace(fits[0], informative=informative, predicted=predicted)]
    )
    assert any('at rest: does not count' in text for text in texts(figure))
    residual = figure.axes[5]
    assert np.isnan(drawn(residual)[0][20:60]).all()
    assert residual.get_ylim()[1] < 10.0


def cut_off(figure):
    """Return what is written beyond the edges of a figure."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    width, height = figure.canvas.get_width_height()
    ticks = [
        label
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for label in axis.get_ticklabels(which='both')
    ]
    written = [text for text in figure.findobj(matplotlib.text.Text) if text.get_text().strip()]
    boxes = [
        (text.get_text(), text.get_window_extent(renderer))
        for text in written
        if text not in ticks  # those beyond the axes are not drawn
    ]
    return [
        text
        for text, box in boxes
        if box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1
    ]


@pytest.mark.slow
def test_nothing_is_cut_off_at_the_edges(case):
    (fits,) = case.validation.values()
    informative = np.array(fits[0].informative)
    informative[20:60] = False
    estimate = case.result.estimate
    t = np.linspace(0.5, 10.0, 20)
    std = estimate.std * np.sqrt(10.0 / t)[:, np.newaxis]
    history = t, estimate.values + std, std, estimate.values
    for number in (0, 10, 20, len(estimate.parameters) - 6):  # any may be the best known
        known = estimate.values.copy()
        known[number : number + 6] *= 1e9
        figure = convergence_figure(*history[:3], known, estimate.parameters)
        assert cut_off(figure) == []
    assert cut_off(parameter_figure(estimate, estimate.values)) == []
    resting = replace(fits[0], informative=informative)
    assert cut_off(torque_figure(case.description.robot, [resting])) == []


def test_parameter_figure_says_what_is_expected_of_all_parameters_together(case):
    estimate = case.result.estimate
    written = '\n'.join(texts(parameter_figure(estimate, estimate.values)))
    count = len(estimate.values)
    lower, upper = count * scipy.stats.f.ppf((0.025, 0.975), count, FREEDOM)
    assert f'in 95 of 100 experiments {lower:.0f} to {upper:.0f}' in written
