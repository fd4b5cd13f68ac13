# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What names leave of the data, over what they may leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.explanation import Chosen, ESTIMATED, Explanation
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.verdict.gap import excess_of, for_a_second, harmed, held
from armid_ros.diagnosis.verdict.where import Excess
from armid_ros.motion import FloatArray
import numpy as np


@dataclass(frozen=True)
class RemainingMisfit:
    """
    What is left of the data of an explanation, measured.

    Attributes
    ----------
    chosen : Chosen
        The explanation, and the unit of its gap.
    unseen : Evidence or None
        Recordings that nothing was fitted to.
    before : Baseline or None
        Recordings from when nothing was wrong.
    given : ArmModel
        The given model.
    settings : DiagnosisSettings
        Thresholds.

    """

    chosen: Chosen
    unseen: Evidence | None
    before: Baseline | None
    given: ArmModel
    settings: DiagnosisSettings

    def beside(self, explanation: Explanation) -> list[Excess]:
        """
        Return what names leave, each kind for all data.

        Where the model stays as given, it is what they leave beside the body, friction and
        discrepancy of both days: another motion visits other states, in which a model has another
        misfit.

        """
        problem, parts = explanation.problem, self._parts(explanation.evidence)
        left = [part.residuals(explanation.fitted.arm) for part in parts]
        if problem is not None and not self.chosen.measured:
            rest = problem.rest(explanation.fitted)
            first = len(explanation.evidence.data)
            left = [rest[:first], *(rest[first:] or one for one in left[1:])]
        found = self._of_data(explanation.evidence, left)
        if self.before is None:
            return found
        return found + [
            for_a_second(one, part, self.before, self.given, self.settings)
            for one, part in zip(left, parts, strict=True)
        ]

    def resting(self, explanation: Explanation) -> list[Excess]:
        """Return by how much joints at rest are held by more than friction, for all data."""
        if self.settings.partner is not None:
            return []
        arm, before, given = explanation.fitted.arm, self.before, self.given
        parts = self._parts(explanation.evidence)
        return [held(arm, part, before, given, self.settings) for part in parts]

    def patched(self, explanation: Explanation) -> Excess:
        """Return what the patched model leaves, whose body may be as it was given."""
        arm, evidence = explanation.fitted.arm, explanation.evidence
        left = self._of_data(evidence, [one.residuals(arm) for one in self._parts(evidence)])
        return Excess(np.max([one.ratio for one in left], axis=0), '')

    def as_it_is(self, explanation: Explanation) -> Excess | None:
        """Return what the given model leaves; None if its rigid body is not fitted anew."""
        if not explanation.refitted:
            return None
        evidence = explanation.evidence
        return self._of_whole(evidence.residuals(self.given), evidence)

    def harmed(self, explanation: Explanation) -> tuple[str, ...]:
        """Return the joints in which the patched model is worse than the given one."""
        measured = replace(explanation, evidence=self._sure(explanation.evidence))
        unseen = None if self.unseen is None else self._sure(self.unseen)
        return harmed(measured, unseen, self.settings)

    def shown_in(self, left: Sequence[Excess], evidence: Evidence) -> Evidence:
        """Return the data in which the worst of what is left shows, of which a sentence speaks."""
        worst = max(range(len(left)), key=lambda k: float(left[k].ratio.max()))
        parts = self._parts(evidence)
        return parts[worst % len(parts)]  # each kind of excess is there once for each of them

    def _parts(self, evidence: Evidence) -> list[Evidence]:
        return [evidence] if self.unseen is None else [evidence, self.unseen]

    def _of_data(self, evidence: Evidence, left: Sequence[Sequence[FloatArray]]) -> list[Excess]:
        """Return residuals of the data, and of those that nothing was fitted to."""
        found = [self._of_whole(left[0], evidence)]
        if self.unseen is not None:
            more, where = self.settings.thresholds.predicted, 'recordings that were not used'
            found.append(excess_of(left[1], self._sure(self.unseen), self.settings, more, where))
        return found

    def _of_whole(self, residual: Sequence[FloatArray], evidence: Evidence) -> Excess:
        """Return a residual of the data: a misfit varies from motion to motion."""
        usual = 1.0 if self.chosen.measured else self.settings.thresholds.predicted
        return excess_of(residual, self._sure(evidence), self.settings, usual)

    def _sure(self, evidence: Evidence) -> Evidence:
        """Return data in units of noise if the misfit is only estimated, which excuses nothing."""
        if self.chosen.floor_in_words != ESTIMATED:
            return evidence
        return replace(evidence, sigma=evidence.noise)
