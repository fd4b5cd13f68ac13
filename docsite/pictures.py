# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Drawing of the pictures of the documentation.

``python -m docsite.pictures [NAME.png ...]`` draws them. Pictures of reports are screenshots.

"""

from __future__ import annotations

from dataclasses import replace
import json
import os
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
import textwrap
from typing import Any

import armid_ros as ar
from armid_ros.nodes.live import LiveDiagnosis, LiveSettings
from armid_ros.nodes.live.request import answer
from armid_ros.papers.elastic.experiments import (
    resonance_experiments,
    RESONANCE_GAIN,
    run_experiment,
)
from armid_ros.papers.elastic.identification.interaction import ideal_response
from armid_ros.papers.elastic.identification.three_steps import identify_two_inertia
from armid_ros.papers.exo.plant.gait_cycle import gait_cycle
from armid_ros.papers.exo.plant.torque_driven import check_cycle
from armid_ros.papers.exo.plant.walkers import walking_pair
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation import Sensors
from armid_ros.simulation.elastic import two_link_loop
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
import numpy as np
from PIL import Image
from scipy import signal, stats

from benchmarks.growth import OUT as GROWTH
from benchmarks.lived_scoring import reliability as bins
from docsite.desk import FRICTION, GAIN, lay_out, LOAD

IMAGES = Path(__file__).parents[1] / 'docs' / 'images'
RESULTS = Path(__file__).parents[1] / 'benchmarks' / 'results'
#: Text next to a point.
TEXT = {'textcoords': 'offset points', 'va': 'center', 'fontsize': 8}
BLUE, ORANGE, GREY = '#0072b2', '#e69f00', '#8c9196'
#: Size for a column of text, and resolution for a screen with two dots per point.
WIDTH, DPI = 7.0, 120
#: More colours would only make the files larger.
_COLOURS = 64

_REPEATS = 60
#: Time of motion in the picture of online identification [s].
_LEARNED = 8.0
#: Correlation time of the torque noise [s].
_LASTING = 0.05


def candidates() -> Figure:
    """Draw the share of the gap that each effect explains alone, if the elbow has a spring."""
    arm = ar.load_model('monday_result/model.yaml')
    found = ar.diagnose(arm, 'today_1', validate='today_2', baseline='monday')
    rows = found.document()['candidates'][:10][::-1]
    names = [' '.join([row['name'].replace('_', ' '), 'in', *row['joints']]) for row in rows]
    named = [row['name'] in found.names for row in rows]
    figure, axes = _figure(3.2)
    colours = [BLUE if one else GREY for one in named]
    axes.barh(names, [100.0 * max(row['share'], 0.0) for row in rows], color=colours)
    axes.set(xlabel='share of the held-out gap that each takes alone [%]', xlim=(0, 100))
    return _plain(figure)


def deviations() -> Figure:
    """Draw errors of repeated identifications, divided by their stated standard deviations."""
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
    figure, axes = _figure(2.8)
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
    """Return correlated torque noise, shape (N, n) [N m]."""
    memory = np.exp(-run.t[1] / _LASTING)
    white = np.random.default_rng(seed).normal(0.0, 0.05, run.q.shape)
    return np.asarray(signal.lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white, axis=0))


def exo_cycle() -> Figure:
    """Draw angles and errors of hip and knee, and foot forces, over a gait cycle."""
    cycle = gait_cycle(walking_pair())
    soft = cycle.pair.with_stiffness(0.8 * cycle.pair.stiffness)
    figure, panels = _figure(6.2, 3, 2, height_ratios=(2, 1.2, 2))
    for column, (joint, most) in enumerate((('hip', 1.5), ('knee', 2.5))):
        name = f'exo_right_{joint}'
        right, wrong = (check_cycle(cycle, name, 200.0, cycle.torques(k)) for k in (None, soft))
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
    for column, machine in enumerate((cycle.own, cycle.other)):
        axes, feet = panels[2, column], machine.feet[..., 1]
        for foot, side in enumerate(('right', 'left')):
            axes.plot(cycle.phase, feet[:, foot], color=(BLUE, ORANGE)[foot], label=f'{side} foot')
        two = machine.support == 2
        axes.fill_between(
            cycle.phase, 0.0, feet.max(), where=two, color=GREY, alpha=0.2, label='both feet'
        )
        axes.set(title=('exoskeleton', 'wearer')[column], ylabel='ground, up [N]')
        axes.set_xlabel('gait cycle of the right leg')
    for axes in (panels[0, 0], panels[1, 1], panels[2, 0]):
        axes.legend(
            frameon=False, fontsize=7, loc='best' if axes is not panels[2, 0] else 'upper left'
        )
    return _plain(figure)


def growth() -> Figure:
    """Draw processor time and memory over the size of the input, as benchmarks.growth measures."""
    document = json.loads(GROWTH.read_text())
    axes_names = list(dict.fromkeys(row['over'] for row in document['jobs']))
    jobs = list(dict.fromkeys(row['job'] for row in document['jobs']))
    colours = dict(zip(jobs, (GREY, BLUE, ORANGE, '#4a9c6d', '#8a5ca8'), strict=True))
    figure, panels = _figure(4.6, 2, len(axes_names), sharey='row', squeeze=False)
    for row in document['jobs']:
        upper, lower = panels[:, axes_names.index(row['over'])]
        name = f'{row["job"]}, slope {row["slope"]:.1f}'
        upper.loglog(row['values'], row['seconds'], 'o-', color=colours[row['job']], label=name)
        lower.loglog(
            row['values'], np.maximum(row['megabytes'], 1.0), 'o-', color=colours[row['job']]
        )
        lower.set_xlabel(row['over'])
        for axes in (upper, lower):
            if row['over'] != 'samples':
                axes.set_xticks(row['values'], row['values'])
            axes.xaxis.set_minor_locator(NullLocator())
    panels[0, 0].set_ylabel('processor time [s]')
    panels[1, 0].set_ylabel('memory [MB]')
    panels[0, 0].set_ylim(0.02, 1e4)
    for axes in panels[0]:
        axes.legend(frameon=False, fontsize=6, loc='upper left')
    return _plain(figure)


def reliability() -> Figure:
    """Draw how often a named effect is right, over its stated probability."""
    found = json.loads((RESULTS / 'probabilities.json').read_text(encoding='utf-8'))
    figure, axes = _figure(3.2)
    axes.plot([0, 1], [0, 1], color=GREY, lw=1, label='calibrated')
    for mean, right, count in bins(found):
        low, high = stats.binomtest(round(right * count), count).proportion_ci(method='wilson')
        axes.plot([mean, mean], [low, high], color=BLUE, lw=1)
        axes.plot(mean, right, 'o', color=BLUE)
        axes.annotate(f'{count} names', (mean, right), (-8, 0), ha='right', **TEXT)
    axes.set(xlabel='probability of the first name', ylabel='share of names that are right')
    axes.set(xlim=(0.4, 1.0), ylim=(0.4, 1.02))
    axes.legend(frameon=False, loc='lower right')
    return _plain(figure)


def excitation() -> Figure:
    """Draw the planned position of each joint between its limits."""
    plan, robot = ar.design_excitation('my_arm.urdf', duration=20.0), ar.load_robot('my_arm.urdf')
    drawn = plan.plot()
    for axes, low, high in zip(drawn, robot.lower, robot.upper, strict=True):
        axes.axhspan(low, high, color=GREY, alpha=0.15)
    return _sized(drawn)


def recording() -> Figure:
    """Draw the torques of all joints in a recording."""
    return _sized(ar.read_recording('monday', 'my_arm.urdf').plot())


def currents() -> Figure:
    """Draw a motor current of a log, and the torque that the current is converted to."""
    log = np.genfromtxt('log.csv', delimiter=',', names=True)
    run = ar.read_recording('log.csv', 'my_arm.urdf', effort='amps_{}', effort_scale=GAIN)
    figure, panels = _figure(3.0, 2, 1, sharex=True)
    panels[0].plot(1e-3 * log['t_ms'], log['amps_2'], color=GREY)
    panels[1].plot(run.t, run.tau[:, 1], color=BLUE)
    panels[0].set(ylabel='amps_2 [A]', xlim=(0.0, 10.0))
    panels[1].set(ylabel='shoulder [N m]', xlabel='time [s]')
    return _plain(figure)


def comparison() -> Figure:
    """Draw the difference of each parameter between two days, in standard deviations."""
    found = ar.compare('monday_result', 'friday_result').core.changes
    size = [abs(one.deviations) for one in found]
    figure, axes = _figure(4.2)
    names = [f'{one.parameter.name}, {one.parameter.joint}' for one in found]
    axes.barh(names, size, color=[ORANGE if one.changed else GREY for one in found])
    axes.set(xscale='log', xlabel='difference in standard deviations; orange: changed')
    axes.tick_params(axis='y', labelsize=6)
    axes.invert_yaxis()
    return _plain(figure)


def bodies() -> Figure:
    """Draw link masses as described, by least squares, and by a physically consistent fit."""
    (figure, axes), robot = _figure(2.6), ar.load_robot('my_arm.urdf')
    for place, (label, colour, masses) in enumerate(
        (
            ('as described', GREY, robot.rigid_parameters[::10]),
            ('least squares', ORANGE, _masses(physical=False)),
            ('--physical', BLUE, _masses(physical=True)),
        )
    ):
        axes.bar(
            np.arange(robot.n_joints) + 0.25 * (place - 1), masses, 0.22, color=colour, label=label
        )
    axes.axhline(0.0, color='black', lw=0.5)
    axes.set(xticks=range(robot.n_joints), xticklabels=robot.links, ylabel='mass [kg]')
    axes.legend(frameon=False)
    return _plain(figure)


def _masses(*, physical: bool) -> np.ndarray:
    model = ar.identify('my_arm.urdf', 'friday', physical=physical)
    return np.asarray(model.arm.robot.rigid_parameters[::10])


def predicted() -> Figure:
    """Draw measured and predicted torques of all joints in a held-out recording."""
    return _sized(ar.identify('my_arm.urdf', 'monday', validate='tuesday').plot())


def own_effect() -> Figure:
    """Draw the residual torque of an arm with a hose over the angle, and the fitted formula."""
    known = ar.ArmModel.of('my_arm.urdf', effects=FRICTION)
    run = ar.simulate(known, 'plan/excitation.yaml', torque_noise=0.05)
    elbow = run.joints.index('elbow')
    angle = run.q[:, elbow]
    noise = run.tau[:, elbow] - ar.simulate(known, 'plan/excitation.yaml').tau[:, elbow]
    (figure, axes), grid = _figure(2.8), np.linspace(angle.min(), angle.max(), 100)
    axes.plot(angle[::20], (1.5 * angle**3 + noise)[::20], '.', color=GREY, ms=2, label='residual')
    axes.plot(grid, 1.5 * grid**3, color=BLUE, label='hose: 1.5 N m/rad³ q³')
    axes.set(xlabel='angle of elbow [rad]', ylabel='torque [N m]')
    axes.legend(frameon=False)
    return _plain(figure)


def payload() -> Figure:
    """Draw the torque of a joint with a load, and its prediction without and with the load."""
    arm = ar.load_model('monday_result/model.yaml')
    found = ar.diagnose(arm, 'friday', baseline='monday')
    axes = found.plot()
    return _sized(axes)


def learned() -> Figure:
    """Draw the torque of a worn gear over the joint angle."""
    x = np.linspace(-1.5, 2.0, 300)
    share = (x - 0.6) / 0.2
    figure, axes = _figure(2.4)
    axes.plot(x, share * np.exp(-(share**2)), color=BLUE)
    axes.axvspan(0.2, 1.0, color=ORANGE, alpha=0.2, label='worn place')
    axes.set(xlabel='angle of elbow [rad]', ylabel='torque [N m]')
    axes.legend(frameon=False)
    return _plain(figure)


def temperature() -> Figure:
    """Draw friction over temperature, with a cold joint on the identified line and a worn one."""
    celsius = np.linspace(15.0, 45.0, 2)
    figure, axes = _figure(2.4)
    axes.plot(celsius, 0.5 - 0.01 * (celsius - 25.0), color=GREY, label='identified on Monday')
    for name, friction, colour in (('cold', 0.55, BLUE), ('worn', 0.68, ORANGE)):
        axes.plot(20.0, friction, 'o', color=colour)
        axes.annotate(name, (20.0, friction), (8, 5), color=colour, **TEXT)
    axes.set(xlabel='temperature of joint [degC]', ylabel='viscous friction [N m s/rad]')
    axes.set_ylim(0.25, 0.75)
    axes.legend(frameon=False)
    return _plain(figure)


def limits() -> Figure:
    """Draw the share of its limits that each joint uses in a planned excitation."""
    plan = ar.design_excitation('my_arm.urdf', duration=20.0)
    used = plan.core.limits_used(plan.arm)
    joints = plan.arm.robot.joints
    figure, axes = _figure(2.6)
    for place, ((name, share), colour) in enumerate(
        zip(used.items(), (BLUE, ORANGE, GREY, 'black'), strict=False)
    ):
        axes.bar(
            np.arange(len(joints)) + 0.2 * (place - 1.5), 100.0 * share, 0.18, color=colour,
            label=name,
        )  # fmt: skip
    axes.axhline(100.0, color='black', lw=0.5)
    axes.set(xticks=range(len(joints)), xticklabels=joints, ylabel='share of the limit [%]')
    axes.legend(frameon=False, ncols=4, loc='upper center', bbox_to_anchor=(0.5, 1.2))
    return _plain(figure)


def damaged() -> Figure:
    """Draw the printed lines of armid identify for a bag that ends early."""
    (bag,) = Path('monday').glob('*.mcap')
    Path('crashed.mcap').write_bytes(bag.read_bytes()[:300_000])
    command = ('identify', 'crashed.mcap', '--robot', 'my_arm.urdf', '--out', 'result')
    return _terminal([f'$ armid {" ".join(command)}', *_answer(*command)])


def springs() -> Figure:
    """Draw measured and modelled frequency responses of two elastic joints."""
    shipped, rng = two_link_set('after'), np.random.default_rng(0)
    sensors, loop = Sensors(velocity_noise=0.004), two_link_loop(shipped, RESONANCE_GAIN)
    runs = [
        run_experiment(plan, shipped, rng, gain=RESONANCE_GAIN, sensors=sensors)
        for plan in resonance_experiments(8, rng)
    ]
    found = identify_two_inertia(runs, shipped.parameters, loop)
    figure, panels = _figure(2.8, 1, 2, sharey=True)
    for k, (axes, joint, own) in enumerate(zip(panels, found.joints, found.measured, strict=True)):
        seen = (own.frequency > 5.0) & (own.frequency < 80.0)
        frequency = own.frequency[seen]
        model = ideal_response(found.parameters, k, frequency)[:, 0, 0]
        axes.plot(frequency, _decibel(own.decoupled[seen, 0]), '.', color=GREY, label='measured')
        axes.plot(frequency, _decibel(model), color=BLUE, label='motor, spring and link')
        axes.set(xscale='log', title=joint, xlabel='frequency [Hz]')
        axes.set_xticks([10, 20, 40, 80], ['10', '20', '40', '80'])
        axes.minorticks_off()
    panels[0].set_ylabel('velocity over torque [dB]')
    panels[0].legend(frameon=False)
    return _plain(figure)


def _decibel(values: np.ndarray) -> np.ndarray:
    return np.asarray(20.0 * np.log10(np.abs(values)))


def fleet() -> Figure:
    """Draw the printed lines of armid fleet for three arms, one with a load from day four on."""
    for arm in ('arm_1', 'arm_2', 'arm_3'):
        for day in range(1, 7):
            loaded = arm == 'arm_2' and day > 3
            effects = (*FRICTION, LOAD) if loaded else FRICTION
            seed = 10 * day + int(arm[-1])
            model = ar.ArmModel.of('my_arm.urdf', effects=effects)
            run = ar.simulate(model, 'plan/excitation.yaml', torque_noise=0.05, rng=seed)
            ar.write_recording(Path('fleet_bags', arm, f'2026-03-0{day}'), run)
    lines = []
    for command in (
        ('identify', 'fleet_bags/*/*', '--robot', 'my_arm.urdf', '--out', 'results'),
        ('watch', '--out', 'results'),
        ('diagnose', '--out', 'results'),
    ):
        text = ' '.join(f'"{word}"' if '*' in word else word for word in command)
        lines += [f'$ armid fleet {text}', *_answer('fleet', *command)]
    return _terminal(lines)


def live() -> Figure:
    """Draw the torque error of the elbow over time, before and after a spring is added."""
    arm = ar.load_model('monday_result/model.yaml')
    parts = [ar.read_recording(name, 'my_arm.urdf') for name in ('tuesday', 'today_1')]
    stream, answers = LiveDiagnosis(arm, LiveSettings(learning=12.0)), []
    came = float(parts[0].t[-1])
    for begin, part in zip((0.0, came + 0.01), parts, strict=True):
        for t, q, tau in zip(part.t + begin, part.q, part.tau, strict=True):
            stream.add(t, q, None, tau)
            if stream.due:
                answers.append(answer(stream.request())[0])
                stream.take(answers[-1])
    answers = [one for one in answers if one.gap]
    ends = [one.end for one in answers]
    elbow = arm.robot.index('elbow')
    before = [one.gap.before[elbow] for one in answers]
    after = [one.gap.after[elbow] for one in answers]
    figure, axes = _figure(2.6)
    axes.plot(ends, before, 'o-', color=ORANGE, label='model as given')
    axes.plot(ends, after, 'o-', color=BLUE, label='with what is named')
    axes.axvline(came, color=GREY, lw=1)
    axes.annotate('spring added', (came, axes.get_ylim()[1]), (4, -8), **TEXT)
    for one, height in zip(answers, before, strict=True):
        name = one.named[0][0].replace('_', ' ') if one.named else one.verdict
        axes.annotate(name, (one.end, height), (0, 9), ha='center', **TEXT)
    axes.set(xlabel='end of the window [s]', ylabel='error of elbow [N m]')
    axes.margins(0.08, 0.2)
    axes.legend(frameon=False, loc='center right')
    return _plain(figure)


def online() -> Figure:
    """Draw the online estimate of the elbow's viscous friction over time, with its interval."""
    run = ar.read_recording('monday', 'my_arm.urdf')
    arm = ar.ArmModel.of('my_arm.urdf', effects='viscous_friction,coulomb_friction')
    identifier, times, values = ar.OnlineIdentifier(arm, rng=np.random.default_rng(0)), [], []
    for k, (t, q, tau) in enumerate(zip(run.t, run.q, run.tau, strict=True)):
        identifier.update(float(t), q, None, tau)
        if k % 10 == 9 and t < _LEARNED:
            found = identifier.estimate()
            index = found.index('viscous_coefficient', 'elbow')
            times.append(t)
            values.append((found.values[index], 1.96 * found.std[index]))
    value, reach = np.array(values).T
    figure, axes = _figure(2.6)
    axes.fill_between(times, value - reach, value + reach, color=BLUE, alpha=0.2, label='95 %')
    axes.plot(times, value, color=BLUE, label='estimate')
    axes.axhline(0.3, color=GREY, label='true')
    axes.set(xlabel='time [s]', ylabel='viscous friction, elbow\n[N m s/rad]', ylim=(0.0, 0.6))
    axes.legend(frameon=False)
    return _plain(figure)


def installed() -> Figure:
    """Draw the printed lines of the first commands after an installation."""
    return _terminal(
        [
            '$ make',
            '$ . .venv/setup.bash',
            '$ armid check my_arm.urdf',
            *_answer('check', 'my_arm.urdf'),
        ]
    )


def refused() -> Figure:
    """Draw an error message of the troubleshooting page."""
    command = ('inspect', 'monday', '--robot', 'bags/none.urdf')
    return _terminal([f'$ armid {" ".join(command)}', *_answer(*command)])


def chain() -> Figure:
    """Draw the steps from a vendor's description to a planned trajectory as boxes."""
    return _boxes(
        [
            'arm.xacro\nwith arguments',
            'URDF\nexpanded',
            'meshes of\n--package',
            'armid check',
            'armid excite',
        ]
    )


def control() -> Figure:
    """Draw the nodes between a planned trajectory and a recording as boxes."""
    return _boxes(
        [
            'excitation.yaml',
            'excitation_\npublisher',
            'joint_trajectory_\ncontroller',
            '/joint_states',
            'recorder',
        ]
    )


def _boxes(texts: list[str]) -> Figure:
    """Return a figure with texts in boxes from left to right, and arrows between them."""
    figure, axes = _figure(1.1)
    for place, text in enumerate(texts):
        style = {'boxstyle': 'round,pad=0.5', 'fc': 'white', 'ec': BLUE}
        axes.text(place, 0.0, text, ha='center', va='center', fontsize=8, bbox=style)
        if place:
            axes.annotate(
                '', (place - 0.38, 0.0), (place - 0.62, 0.0), arrowprops={'arrowstyle': '->'}
            )
    axes.set(xlim=(-0.5, len(texts) - 0.5), ylim=(-1.0, 1.0))
    axes.axis('off')
    return figure


def _answer(*command: str) -> list[str]:
    """Return the lines that an armid command prints, without its lines of progress."""
    run = [sys.executable, '-m', 'armid_ros.cli', *command]
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    lines = (done.stdout + done.stderr).rstrip().splitlines()
    lines = [line for line in lines if ' %, ' not in line]
    return [part for line in lines for part in textwrap.wrap(line, 98)]


def _terminal(lines: list[str]) -> Figure:
    """Return a figure of text lines as a terminal shows them."""
    figure = Figure(figsize=(WIDTH, 0.135 * len(lines) + 0.25), facecolor='#1f2326')
    top = {'family': 'monospace', 'fontsize': 7.5, 'color': '#e6e6e6', 'va': 'top'}
    figure.text(
        0.02, 1.0 - 0.1 / figure.get_figheight(), '\n'.join(lines).replace('$', r'\$'), **top
    )
    return figure


def _figure(height: float, *panels: int, **options: Any) -> tuple[Figure, Any]:
    """Return a figure as wide as a column of text, and its panels."""
    figure = Figure(figsize=(WIDTH, height), layout='constrained')
    return figure, figure.subplots(*panels, **options)


def _plain(figure: Figure) -> Figure:
    """Return a figure without the upper and right lines of its frames."""
    for axes in figure.axes:
        axes.spines[['top', 'right']].set_visible(False)
    return figure


def _sized(drawn: np.ndarray) -> Figure:
    """Return the figure of the given axes, as wide as a column of text."""
    figure: Figure = drawn.flat[0].figure
    figure.set_size_inches(WIDTH, 1.1 * drawn.size + 0.5)
    return figure


PICTURES = {
    f'{picture.__name__}.png': picture
    for picture in (
        *(bodies, candidates, chain, comparison, control, currents, damaged, deviations),
        *(excitation, exo_cycle, fleet, growth, installed, learned, limits, live, online),
        *(own_effect, payload, predicted, recording, refused, reliability, springs, temperature),
    )
}


def main() -> None:
    """Draw the pictures that the command line names, or all pictures."""
    with TemporaryDirectory() as folder:
        os.chdir(lay_out(Path(folder)))
        for name in sys.argv[1:] or PICTURES:
            PICTURES[name]().savefig(IMAGES / name, dpi=DPI)
            with Image.open(IMAGES / name) as drawn:
                drawn.convert('RGB').quantize(_COLOURS).save(IMAGES / name, optimize=True)


if __name__ == '__main__':
    main()
