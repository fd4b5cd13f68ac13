# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The pictures of the pages, drawn anew: ``python -m docsite.pictures``.

Those of the demo are written by ``armid demo``.

"""

from __future__ import annotations

from dataclasses import replace
import json
import os
from pathlib import Path
import sys
from tempfile import TemporaryDirectory

import armid_ros as ar
from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.papers.exo.plant.gait_cycle import check_cycle, gait_cycle
from armid_ros.papers.exo.plant.walkers import walking_pair
from matplotlib.figure import Figure
import numpy as np
from scipy import signal, stats

from benchmarks.lived_scoring import reliability as bins
from docsite.desk import FRICTION, lay_out

IMAGES = Path(__file__).parents[1] / 'docs' / 'images'
RESULTS = Path(__file__).parents[1] / 'benchmarks' / 'results'
#: Text beside a point.
TEXT = {'textcoords': 'offset points', 'va': 'center', 'fontsize': 8}
BLUE, ORANGE, GREY = '#0072b2', '#e69f00', '#8c9196'
#: Fit to a column of text, and sharp on a screen of two dots per point.
WIDTH, DPI = 7.0, 120

_REPEATS = 60
#: Time that the noise of the torque lasts [s].
_LASTING = 0.05


def candidates() -> Figure:
    """Draw the share of the gap that each cause takes alone, for the spring at the elbow."""
    arm = ar.load_model('monday_result/model.yaml')
    found = ar.diagnose(arm, 'today_1', validate='today_2', baseline='monday')
    rows = found.document()['candidates'][:10][::-1]
    names = [' '.join([row['name'].replace('_', ' '), 'in', *row['joints']]) for row in rows]
    named = [row['name'] in found.names for row in rows]
    figure = Figure(figsize=(WIDTH, 3.2), layout='constrained')
    axes = figure.subplots()
    colours = [BLUE if one else GREY for one in named]
    axes.barh(names, [100.0 * max(row['share'], 0.0) for row in rows], color=colours)
    axes.set(xlabel='share of the held-out gap that each takes alone [%]', xlim=(0, 100))
    axes.spines[['top', 'right']].set_visible(False)
    return figure


def deviations() -> Figure:
    """Draw how far repeats are off, in stated deviations, with noise that lasts."""
    truth = ar.ArmModel.of('my_arm.urdf', effects=FRICTION)
    clean = ar.simulate(truth, 'plan/excitation.yaml')
    true = {'viscous_coefficient': 0.3, 'coulomb_torque': 0.2, 'torque_offset': 0.0}
    off = []
    for seed in range(_REPEATS):
        noisy = replace(clean, tau=clean.tau + _noise(clean, seed))
        estimate = ar.identify('my_arm.urdf', noisy).estimate
        off += [
            (value - true[name.name]) / std
            for name, value, std in zip(
                estimate.parameters, estimate.values, estimate.std, strict=True
            )
            if name.name in true
        ]
    figure = Figure(figsize=(WIDTH, 2.8), layout='constrained')
    axes = figure.subplots()
    x = np.linspace(-4.0, 4.0, 200)
    held = 100.0 * np.mean(np.abs(off) < stats.norm.ppf(0.975))
    axes.hist(off, bins=np.arange(-4.0, 4.2, 0.4), density=True, color=ORANGE, label='repeats')
    axes.plot(x, stats.norm.pdf(x), color=BLUE, label='as stated')
    axes.axvspan(-1.96, 1.96, color=GREY, alpha=0.15, label=f'95 %: holds {held:.0f} %')
    axes.set(xlabel='error of the friction in stated standard deviations', yticks=[])
    axes.spines[['top', 'right', 'left']].set_visible(False)
    axes.legend(frameon=False)
    return figure


def _noise(run: ar.Recording, seed: int) -> np.ndarray:
    """Return torque noise that lasts, shape (N, n) [N m]."""
    memory = np.exp(-run.t[1] / _LASTING)
    white = np.random.default_rng(seed).normal(0.0, 0.05, run.q.shape)
    return np.asarray(signal.lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white, axis=0))


def exo_cycle() -> Figure:
    """Draw hip, knee and feet of the leg pair over a cycle, errors with those of the source."""
    cycle = gait_cycle(walking_pair(), read_gait())
    soft = cycle.pair.with_stiffness(0.8 * cycle.pair.stiffness)
    figure = Figure(figsize=(WIDTH, 6.2), layout='constrained')
    panels = figure.subplots(3, 2, height_ratios=(2, 1.2, 2))
    for column, (joint, most) in enumerate((('hip', 1.5), ('knee', 2.5))):
        name = f'exo_right_{joint}'
        right, wrong = (check_cycle(cycle, name, 200.0, k) for k in (None, soft))
        phase = cycle.phase[::2]
        angle, error = panels[0, column], panels[1, column]
        angle.plot(phase, np.degrees(right.prescribed), color=GREY, lw=4, label='prescribed')
        angle.plot(phase, np.degrees(right.followed), color=BLUE, label='by its torque')
        angle.set(title=joint, ylabel='angle [°]')
        error.axhspan(-most, most, color=GREY, alpha=0.2, label=f'source: {most:g}°')
        error.plot(phase, np.degrees(right.error), color=BLUE)
        error.plot(
            phase, np.degrees(wrong.error), color=ORANGE, label='torques for springs 20 % too soft'
        )
        error.set(ylabel='error [°]', ylim=(-1.15 * most, 1.15 * most))
    for column, other in enumerate((False, True)):
        axes = panels[2, column]
        feet = cycle.feet(other=other)[..., 1]
        for foot, side in enumerate(('right', 'left')):
            axes.plot(cycle.phase, feet[:, foot], color=(BLUE, ORANGE)[foot], label=f'{side} foot')
        two = cycle.support(other=other) == 2
        axes.fill_between(
            cycle.phase, 0.0, feet.max(), where=two, color=GREY, alpha=0.2, label='both feet'
        )
        axes.set(title=('exoskeleton', 'wearer')[column], ylabel='ground, up [N]')
        axes.set_xlabel('gait cycle of the right leg')
    for axes in panels.ravel():
        axes.spines[['top', 'right']].set_visible(False)
    for axes in (panels[0, 0], panels[1, 1], panels[2, 0]):
        axes.legend(
            frameon=False, fontsize=7, loc='best' if axes is not panels[2, 0] else 'upper left'
        )
    return figure


def reliability() -> Figure:
    """Draw how often first names of the diagnosis are right, over their probability."""
    found = json.loads((RESULTS / 'probabilities.json').read_text(encoding='utf-8'))
    figure = Figure(figsize=(WIDTH, 3.2), layout='constrained')
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color=GREY, lw=1, label='calibrated')
    for mean, right, count in bins(found):
        low, high = stats.binomtest(round(right * count), count).proportion_ci(method='wilson')
        axes.plot([mean, mean], [low, high], color=BLUE, lw=1)
        axes.plot(mean, right, 'o', color=BLUE)
        axes.annotate(f'{count} names', (mean, right), (-8, 0), ha='right', **TEXT)
    axes.set(xlabel='probability of the first name', ylabel='share of names that are right')
    axes.set(xlim=(0.4, 1.0), ylim=(0.4, 1.02))
    axes.spines[['top', 'right']].set_visible(False)
    axes.legend(frameon=False, loc='lower right')
    return figure


PICTURES = {
    'candidates.png': candidates,
    'deviations.png': deviations,
    'exo_cycle.png': exo_cycle,
    'reliability.png': reliability,
}


def main() -> None:
    """Write the pictures that are named, or all."""
    with TemporaryDirectory() as folder:
        os.chdir(lay_out(Path(folder)))
        for name in sys.argv[1:] or PICTURES:
            PICTURES[name]().savefig(IMAGES / name, dpi=DPI)


if __name__ == '__main__':
    main()
