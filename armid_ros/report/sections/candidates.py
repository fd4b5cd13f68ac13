# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The league of candidates: what each would explain, and how little of it could have been seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis
from armid_ros.diagnosis.league import Standing
from armid_ros.diagnosis.verdict.detectable import smallest_size
from armid_ros.report.notation import digits
from armid_ros.report.page import Section

_MOST = 15


@dataclass(frozen=True)
class Row:
    """One candidate, as text."""

    name: str
    joints: str
    gain: str
    replicated: str
    value: str
    visible: str
    detectable: str
    adjusted_p: str
    inclusion: str
    named: bool


@dataclass(frozen=True)
class CandidateTable(Section):
    """
    Candidates of the first look, best first.

    Attributes
    ----------
    diagnosis : Diagnosis
        What was found.

    """

    title: ClassVar[str] = 'Candidates'
    template: ClassVar[str] = 'candidates.html'

    diagnosis: Diagnosis

    @property
    def rows(self) -> Sequence[Row]:
        """The best candidates."""
        names = {finding.name for finding in self.diagnosis.findings}
        rows = []
        for standing in self.diagnosis.league.first[:_MOST]:
            trial, score = standing.trial, standing.trial.score
            effect = score.group.effect
            quantity = effect.quantities[score.group.kept[0] % len(effect.quantities)]
            value = f'{digits(float(score.values[0]))} {quantity.unit}'
            rows.append(
                Row(
                    effect.name.replace('_', ' '),
                    ', '.join(effect.joints),
                    digits(trial.gain),
                    f'{int((trial.z >= 3.0).sum())} of {len(trial.z)}',
                    value.strip(),
                    f'{100.0 * score.visible:.0f} %',
                    _size(standing),
                    _probability(standing.adjusted_p),
                    f'{100.0 * standing.inclusion:.0f} %',
                    effect.name in names,
                )
            )
        return rows


def _size(standing: Standing) -> str:
    """Return from which size on a candidate shows, with its unit."""
    effect = standing.trial.score.group.effect
    index, size = smallest_size(standing.trial.score)
    return f'{digits(size)} {effect.quantities[index % len(effect.quantities)].unit}'.strip()


def _probability(p: float) -> str:
    """Return a p value to the digit that matters."""
    if p < 1e-4:
        return '< 0.0001'
    return f'{p:.1g}' if p < 0.1 else f'{p:.2f}'
