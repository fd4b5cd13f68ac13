# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Measured against predicted torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification import Fit, Score
from armid_ros.motion import FloatArray
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.charts import Chart, joined, joined_time, Role, Series, thinned
from armid_ros.report.notation import digits, torque_unit
from armid_ros.report.page import Section
from armid_ros.robots import Robot
import numpy as np


@dataclass(frozen=True)
class JointCurves:
    """One joint of one recording, drawn."""

    name: str
    summary: str
    torque: Chart
    residual: Chart


@dataclass(frozen=True)
class ShownRecording:
    """A recording whose curves are drawn."""

    source: str
    role: str
    joints: Sequence[JointCurves]


@dataclass(frozen=True)
class JointErrors(Section):
    """
    How large the errors are, without a curve.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    training : mapping of str to sequence of Fit
        Data it was fitted to, by recording.
    validation : mapping of str to sequence of Fit
        Held-out data, by recording.

    """

    title: ClassVar[str] = 'Errors'
    template: ClassVar[str] = 'joint_errors.html'

    robot: Robot
    training: Mapping[str, Sequence[Fit]]
    validation: Mapping[str, Sequence[Fit]]

    @property
    def bars(self) -> BarChart:
        """Relative error of each joint, held-out and training, the worst joint first."""
        groups: list[tuple[Role, Mapping[str, Sequence[Fit]], str]] = [
            ('after', self.validation, 'held-out'),
            ('faint', self.training, 'training'),
        ]
        roles = [(role, label) for role, fits, label in groups if fits]
        scores = [
            (role, Score.of([fit for part in fits.values() for fit in part]))
            for role, fits, _ in groups
            if fits
        ]
        rows = []
        for joint in _worst_first(scores[0][1]):
            unit = torque_unit(self.robot, joint)
            bars = [
                Bar(
                    float(score.joint_relative_error_percent[joint]),
                    role,
                    f'{digits(score.joint_relative_error_percent[joint])} % '
                    f'({digits(score.rms[joint])} {unit} rms)',
                )
                for role, score in scores
            ]
            rows.append((self.robot.joints[joint], bars))
        return BarChart(rows, '%', roles)


@dataclass(frozen=True)
class FitSection(JointErrors):
    """
    How well the model predicts the torques: `JointErrors` with curves.

    Attributes
    ----------
    reach : ndarray, shape (n,)
        Half width of the 95 % interval of the predicted torque [N m].

    """

    title: ClassVar[str] = 'Fit'
    template: ClassVar[str] = 'fit.html'

    reach: FloatArray

    @property
    def certainty(self) -> str:
        """Half width of the interval of every joint's torque in words."""
        return ', '.join(
            f'{name} ±{digits(self.reach[joint])} {torque_unit(self.robot, joint)}'
            for joint, name in enumerate(self.robot.joints)
        )

    @property
    def errors(self) -> list[tuple[str, str, float]]:
        """Return the recording, role and relative error [%], worst first within each role."""
        rows = []
        for role, group in (('held-out', self.validation), ('training', self.training)):
            scored = [
                (Score.of(fits).relative_error_percent, name) for name, fits in group.items()
            ]
            rows += [(name, role, error) for error, name in sorted(scored, reverse=True)]
        return rows

    @property
    def rests(self) -> bool:
        """Whether a joint is held by friction somewhere."""
        groups = (*self.training.values(), *self.validation.values())
        return not all(bool(fit.informative.all()) for fits in groups for fit in fits)

    @property
    def shown(self) -> list[ShownRecording]:
        """Return the worst held-out recording, and the worst of the training data."""
        chosen = []
        for role, group in (('held-out', self.validation), ('training', self.training)):
            if group:
                worst = max(group, key=lambda name: Score.of(group[name]).relative_error_percent)
                chosen.append(ShownRecording(worst, role, self._joints(worst, group[worst], role)))
        return chosen

    def _joints(self, source: str, fits: Sequence[Fit], role: str) -> list[JointCurves]:
        score = Score.of(fits)
        drawn = []
        for joint in _worst_first(score):
            name, unit = self.robot.joints[joint], torque_unit(self.robot, joint)
            percent = digits(score.joint_relative_error_percent[joint])
            summary = f'residual {digits(score.rms[joint])} {unit} rms, {percent} %'
            torque, residual = fit_charts(fits, joint, unit, f'{role}-{joint}')
            drawn.append(JointCurves(name, summary, torque, residual))
        return drawn


def _worst_first(score: Score) -> list[int]:
    """Return the joints by falling relative error."""
    return [int(joint) for joint in np.argsort(-score.joint_relative_error_percent)]


def fit_charts(fits: Sequence[Fit], joint: int, unit: str, link: str) -> tuple[Chart, Chart]:
    """
    Draw the torque of one joint, measured and predicted, and the residual.

    Parameters
    ----------
    fits : sequence of Fit
        Stretches of one recording.
    joint : int
        Which joint.
    unit : str
        Unit of its torque.
    link : str
        Name under which both zoom together.

    """
    t = joined_time([fit.motion.t for fit in fits])
    measured = joined([fit.motion.tau[:, joint] for fit in fits if fit.motion.tau is not None])
    predicted = joined([fit.predicted[:, joint] for fit in fits])
    residual = measured - predicted
    counts = joined([fit.informative[:, joint].astype(float) for fit in fits]) > 0.5
    kept = thinned(measured, residual)
    torque_chart = Chart(
        t[kept],
        [
            Series('measured', measured[kept], 'measured'),
            Series('predicted', predicted[kept], 'predicted'),
        ],
        '',
        f'torque [{unit}]' if unit == 'N m' else f'force [{unit}]',
        height=200,
        link=link,
    )
    residual_chart = Chart(
        t[kept],
        [
            Series('at rest, not counted', np.where(counts, np.nan, residual)[kept], 'faint'),
            Series('residual', np.where(counts, residual, np.nan)[kept], 'residual'),
        ],
        'time [s]',
        f'residual [{unit}]',
        height=145,
        link=link,
        symmetric=True,
        legend=False,
    )
    return torque_chart, residual_chart
