# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gap, step by step, down to the noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis
from armid_ros.report.bars import Bar, BarChart
from armid_ros.report.notation import digits
from armid_ros.report.page import Section
import numpy as np


@dataclass(frozen=True)
class Staircase(Section):
    """
    Error over noise after each effect that was added.

    Attributes
    ----------
    diagnosis : Diagnosis
        What was found.

    """

    title: ClassVar[str] = 'Step by step'
    template: ClassVar[str] = 'staircase.html'

    diagnosis: Diagnosis

    @property
    def bars(self) -> BarChart:
        """Error of the worst joint over its noise, after each step."""
        explanation = self.diagnosis.explanation
        assert explanation is not None
        rows = [('model without', [_bar(float(explanation.reference_losses.max()), 'before')])]
        for step in explanation.steps:
            group = step.trial.score.group
            where = f' ({", ".join(group.effect.joints)})' if group.effect.joints else ''
            label = f'+ {group.effect.name.replace("_", " ")}{where}'
            rows.append((label, [_bar(float(step.after.max()), 'after')]))
        rows.append(('noise', [_bar(1.0, 'floor')]))
        return BarChart(rows, '')

    @property
    def reason(self) -> str:
        """Why the search ended, in words."""
        explanation = self.diagnosis.explanation
        assert explanation is not None
        worst = float(explanation.losses.max())
        if worst < 1.25:
            return 'The search ended because every joint is at its noise.'
        return (
            'The search ended because no further effect is possible, replicated and explains '
            'a real share of what is left.'
        )


def _bar(loss: float, role: str) -> Bar:
    size = float(np.sqrt(loss))
    return Bar(size, role, f'{digits(size)} times the noise')  # type: ignore[arg-type]
