# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sections with measured and predicted torque, and with simulated motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armid_ros.identification import Fit, Score
from armid_ros.identification.assess.verification import ForwardScore, ForwardValidation
from armid_ros.motion import FloatArray
from armid_ros.report.blocks import Bar, BarChart, DataTable, Fold, Panels, Paragraph
from armid_ros.report.charts import Chart, joined, joined_time, Role, Series
from armid_ros.report.notation import counted, digits, plain, sentence
from armid_ros.report.page import Section, Templated
from armid_ros.robots import Robot
import numpy as np

#: Fits by recording.
Fits = Mapping[str, Sequence[Fit]]

ZOOM = 'Drag across a plot, or pinch it, to zoom; double-click or double-tap to reset.'


def error_bars(robot: Robot, training: Fits, validation: Fits, halves: Score) -> BarChart:
    """
    Return bars of each joint's relative torque error, the worst joint first.

    Held-out and training errors are shown. Without held-out recordings, each half of the data is
    predicted by the fit to the other half.

    """
    fitted, held_out = (
        [fit for part in fits.values() for fit in part] for fits in (training, validation)
    )
    test, label = halves, 'in a cross-check: each half of the data predicted from the other'
    if held_out:
        test, label = Score.of(held_out), 'on recordings not used for the fit'
    shown: list[tuple[Role, str, Score]] = [
        ('after', f'torque error {label}', test),
        ('faint', 'torque error on the recordings of the fit', Score.of(fitted)),
    ]
    rows = []
    for joint in np.argsort(-test.joint_relative_error_percent):
        errors = [float(score.joint_relative_error_percent[joint]) for *_, score in shown]
        bars = [
            Bar(error, role, f'{digits(error)} %')
            for error, (role, *_) in zip(errors, shown, strict=True)
        ]
        rows.append((robot.joints[joint], bars))
    return BarChart(rows, [(role, label) for role, label, _ in shown])


def fit_section(robot: Robot, training: Fits, validation: Fits, reach: FloatArray) -> Section:
    """
    Return the section with measured and predicted torque of each joint.

    Parameters
    ----------
    robot : Robot
        Joints and units.
    training, validation : mapping of str to sequence of Fit
        Fits of the training and of the held-out data, by recording.
    reach : ndarray, shape (n,)
        Half width of the 95 % interval of the predicted torque [N m].

    """
    groups = {'held-out': validation, 'training': training}
    least = int(np.argmax(reach))
    uncertainty = f'±{digits(float(reach[least]))} {robot.torque_units[least]}'
    blocks: list[Templated] = []
    errors = [
        (name, role, error)
        for role, group in groups.items()
        for error, name in sorted(
            ((Score.of(fits).relative_error_percent, name) for name, fits in group.items()),
            reverse=True,
        )
    ]
    several = len(errors) > 2
    rests = not all(
        bool(fit.informative.all())
        for group in groups.values()
        for fits in group.values()
        for fit in fits
    )
    still = ' Grey residual: static friction holds the joint, and the sample is not used.'
    hint = Paragraph(ZOOM + still * rests, 'hint')
    for role, group in groups.items():
        if not group:
            continue
        worst = next(name for name, own, _ in errors if own == role)
        score = Score.of(group[worst])
        panels = []
        for joint in map(int, np.argsort(-score.joint_relative_error_percent)):
            unit = robot.torque_units[joint]
            share = digits(score.joint_relative_error_percent[joint])
            text = f'residual {digits(score.rms[joint])} {unit} rms, {share} %'
            charts = _fit_charts(group[worst], joint, unit, f'{role}-{joint}')
            panels.append((robot.joints[joint], text, charts))
        recording = f'{role} recording{" predicted worst" * several}: {worst}'
        if role == errors[0][1]:
            name, text, charts = panels.pop(0)
            blocks += [Paragraph(f'{name} is the worst joint: {text}.'), *charts, hint]
            recording = f'other joints of the {recording}'
        else:
            recording = f'torques of the {recording}'
        if panels:
            blocks.append(Fold(recording[0].upper() + recording[1:], [Panels(panels)]))
    if several:
        rows = [(name, role, f'{digits(error)} %') for name, role, error in errors]
        table = DataTable(('Recording', 'Used for', 'Error'), rows, (0, 1))
        blocks.append(Fold(f'{counted(len(errors), "recording")} one by one', [table]))
    blocks.append(
        Paragraph(
            f'Parameter errors change the predicted torque by at most {uncertainty}, at '
            f'{robot.joints[least]} (95 %, rms over the motion). Larger residuals come from noise '
            'or from missing effects.'
        )
    )
    return Section('Torque', blocks)


def _fit_charts(fits: Sequence[Fit], joint: int, unit: str, link: str) -> tuple[Chart, Chart]:
    """Return charts of one joint: measured and predicted torque, and residual."""
    t = joined_time([fit.motion.t for fit in fits])
    measured = joined([fit.motion.tau[:, joint] for fit in fits if fit.motion.tau is not None])
    predicted = joined([fit.predicted[:, joint] for fit in fits])
    residual = measured - predicted
    counts = joined([fit.informative[:, joint].astype(float) for fit in fits]) > 0.5
    torque_chart = Chart.over_time(
        t,
        [Series('measured', measured, 'measured'), Series('predicted', predicted, 'predicted')],
        f'torque [{unit}]' if unit == 'N m' else f'force [{unit}]',
        height=200,
        link=link,
    )
    residual_chart = Chart.over_time(
        t,
        [
            Series('at rest, not counted', np.where(counts, np.nan, residual), 'faint'),
            Series('residual', np.where(counts, residual, np.nan), 'residual'),
        ],
        f'residual [{unit}]',
        height=145,
        link=link,
        symmetric=True,
        legend=False,
    )
    return torque_chart, residual_chart


def forward_section(
    robot: Robot,
    pairs: Sequence[ForwardValidation],
    labels: tuple[str, str] = ('description', 'identified'),
) -> Section:
    """
    Return the section with position errors of two models, simulated with recorded torques.

    Parameters
    ----------
    robot : Robot
        Joints and units.
    pairs : sequence of ForwardValidation
        One for each held-out recording.
    labels : tuple of str
        Names of both models.

    """
    names = labels if any(not pair.same for pair in pairs) else ('the model',)
    blocks: list[Templated] = [
        Paragraph(
            'Root mean square position error of each joint, the worst joint first. The recorded '
            'torques drive the simulated arm. An 8 Hz feedback keeps the arm at the recorded '
            'motion, because commanded positions are not recorded.'
        )
    ]
    for number, pair in enumerate(pairs):
        models: list[tuple[Role, str, ForwardScore]] = [('after', names[-1], pair.after)]
        if pair.before is not None and not pair.same:
            models.insert(0, ('before', labels[0], pair.before))
        own: list[Templated] = []
        if pair.before is None:
            inconsistent = 'its inertias are not physically consistent'
            own.append(Paragraph(f'The {labels[0]} cannot be simulated: {inconsistent}.'))
        comment = pair.comment()
        if comment:
            own.append(Paragraph(sentence(comment)))
        errors = [1e3 * score.position_error for *_, score in models]
        for unit in dict.fromkeys(pair.after.units):
            rows = [
                (
                    robot.joints[joint],
                    [
                        Bar(error[joint], role, f'{plain(error[joint])} m{unit}')
                        for error, (role, *_) in zip(errors, models, strict=True)
                    ],
                )
                for joint in np.argsort(-np.max(errors, axis=0))
                if pair.after.units[joint] == unit
            ]
            own.append(BarChart(rows, [(role, label) for role, label, _ in models]))
        own += _worst_joint(robot, pair, models)
        line = f'{pair.after.source}: at most {pair.errors()}'
        blocks.append(Fold(line, own, opened=number == 0))
    return Section('Forward validation', blocks)


def _worst_joint(
    robot: Robot, pair: ForwardValidation, models: Sequence[tuple[Role, str, ForwardScore]]
) -> list[Templated]:
    """Return a chart, with a caption, of the position error of the worst joint over time."""
    farthest = max((score for *_, score in models), key=lambda one: one.position_error.max())
    worst, motion = int(farthest.position_error.argmax()), pair.after.motion
    curves = [1e3 * (score.simulated[:, worst] - motion.q[:, worst]) for *_, score in models]
    joint = robot.joints[worst]
    return [
        Paragraph(f'Position error of {joint}, the worst joint, over time:', 'hint'),
        Chart.over_time(
            motion.t,
            [
                Series(label, curve, role)
                for (role, label, _), curve in zip(models, curves, strict=True)
            ],
            f'{joint}: error [m{pair.after.units[worst]}]',
            height=190,
            symmetric=True,
        ),
    ]
