# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The candidates of the first look, in the order in which they were judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis
from armid_ros.diagnosis.search.patch import room
from armid_ros.diagnosis.search.trial import Trial
from armid_ros.report.notation import percent, with_interval
from armid_ros.report.page import Section
import numpy as np

_MOST = 15
#: Standard deviations by which a value has to differ from zero, and from what is possible.
_TOLD = 3.0


@dataclass(frozen=True)
class CandidateRow:
    """One candidate, as text."""

    name: str
    joints: str
    share: str
    odds: str
    value: str
    visible: str
    named: bool


@dataclass(frozen=True)
class CandidateTable(Section):
    """What each cause alone would explain."""

    title: ClassVar[str] = 'Candidates'
    template: ClassVar[str] = 'candidates.html'

    diagnosis: Diagnosis

    @property
    def rows(self) -> Sequence[CandidateRow]:
        """Return the best candidates."""
        explanation = self.diagnosis.explanation
        survey = None if explanation is None else explanation.survey
        if survey is None:
            return []
        return [self._row(trial) for trial in survey.ranking[:_MOST]]

    def _row(self, trial: Trial) -> CandidateRow:
        effect = trial.effect
        names = {finding.name for finding in self.diagnosis.findings}
        return CandidateRow(
            effect.name.replace('_', ' '),
            ', '.join(effect.joints) or 'whole arm',
            percent(trial.share),
            f'{trial.gain / 2.0:.1f}',
            self._value(trial),
            percent(trial.visible),
            effect.said_as in names,
        )

    def _value(self, trial: Trial) -> str:
        """Return the first value, where it is one that the cause can have."""
        arm, effect, kept = self.diagnosis.arm, trial.effect, list(trial.named.kept)
        if self.diagnosis.explanation is not None:
            arm = self.diagnosis.explanation.given
        lower, upper = (bound[kept] for bound in room(effect, arm))
        slack = _TOLD * trial.std
        inside = (trial.values > lower - slack) & (trial.values < upper + slack)
        if not inside.all():
            return 'not possible'
        if not np.any(np.abs(trial.values) > _TOLD * trial.std):
            return 'includes 0'
        name = effect.parameters(arm.robot)[kept[0]]
        return with_interval(float(trial.values[0]), float(trial.std[0]), name.unit)
