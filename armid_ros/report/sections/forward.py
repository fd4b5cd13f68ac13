# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Held-out recordings, simulated in closed loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.identification.assess.verification import ForwardScore, ForwardValidation
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.charts import Chart, Role, Series, thinned
from armid_ros.report.notation import digits, torque_unit
from armid_ros.report.page import Section
from armid_ros.robots import Robot


@dataclass(frozen=True)
class Forward(Section):
    """
    Position error of the description and of the identified arm, driven by recorded torques.

    Attributes
    ----------
    robot : Robot
        Gives joints and units.
    pairs : sequence of ForwardValidation
        One a held-out recording.
    labels : tuple of str
        What both models are called.

    """

    title: ClassVar[str] = 'Forward validation'
    template: ClassVar[str] = 'forward.html'

    robot: Robot
    pairs: Sequence[ForwardValidation]
    labels: tuple[str, str] = ('description', 'identified')

    @property
    def drawn(self) -> list[tuple[ForwardValidation, BarChart, str, Chart]]:
        """Return the recording, errors of its joints, and which is the worst, with its error."""
        return [
            (pair, self._bars(pair), self.robot.joints[_worst(pair)], self._chart(pair))
            for pair in self.pairs
        ]

    def _bars(self, pair: ForwardValidation) -> BarChart:
        roles: list[tuple[Role, str, ForwardScore]] = [('after', self.labels[1], pair.after)]
        if pair.before is not None:
            roles.insert(0, ('before', self.labels[0], pair.before))
        rows = []
        for joint, name in enumerate(self.robot.joints):
            unit = torque_unit(self.robot, joint)
            bars = [
                Bar(
                    1e3 * float(score.position_error[joint]),
                    role,
                    f'{digits(1e3 * score.position_error[joint])} m{score.units[joint]}, '
                    f'{digits(score.torque_error[joint])} {unit}',
                )
                for role, _, score in roles
            ]
            rows.append((name, bars))
        return BarChart(rows, 'mrad', [(role, label) for role, label, _ in roles], True)

    def _chart(self, pair: ForwardValidation) -> Chart:
        joint = _worst(pair)
        motion = pair.after.motion
        errors: list[tuple[str, Role, ForwardScore]] = [(self.labels[1], 'after', pair.after)]
        if pair.before is not None:
            errors.insert(0, (self.labels[0], 'before', pair.before))
        curves = [1e3 * (s.simulated[:, joint] - motion.q[:, joint]) for _, _, s in errors]
        kept = thinned(*curves)
        return Chart(
            motion.t[kept],
            [
                Series(label, curve[kept], role)
                for (label, role, _), curve in zip(errors, curves, strict=True)
            ],
            'time [s]',
            f'{self.robot.joints[joint]}: error [m{pair.after.units[joint]}]',
            height=190,
            symmetric=True,
        )


def _worst(pair: ForwardValidation) -> int:
    """Return the joint that one of the models is off most, whichever that is."""
    scores = [score for score in (pair.before, pair.after) if score is not None]
    return int(max(scores, key=lambda score: score.position_error.max()).position_error.argmax())
