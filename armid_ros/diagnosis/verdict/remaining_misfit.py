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
from armid_ros.diagnosis.search.question import frees_body
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.diagnosis.verdict.attribution import Names
from armid_ros.diagnosis.verdict.gap import excess_of, for_a_second, harmed, held
from armid_ros.diagnosis.verdict.where import Excess
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

    def beside(self, names: Names) -> list[Excess]:
        """
        Return what names leave beside a body common to both days, each kind for all data.

        Something is missing where it is so with a model discrepancy and without: another motion
        visits other states, in which a model has another misfit.

        """
        found = self._of_rest(names.rest)
        if names.rest.beside is None or max(one.ratio.max() for one in found) <= 1.0:
            return found
        others = self._of_rest(names.rest.beside_discrepancy)
        return [
            replace(one, ratio=np.minimum(one.ratio, other.ratio))
            for one, other in zip(found, others, strict=True)
        ]

    def resting(self, names: Names) -> list[Excess]:
        """Return by how much joints at rest are held by more than friction, for all data."""
        if self.settings.partner is not None:
            return []
        arm, before, given = names.rest.fitted.arm, self.before, self.given
        parts = self._parts(names.rest.evidence)
        return [held(arm, part, before, given, self.settings) for part in parts]

    def patched(self, names: Names) -> Excess:
        """Return what the patched model leaves, whose body may be as it was given."""
        left = self._of_data(names.stated)
        return Excess(np.max([one.ratio for one in left], axis=0), '')

    def as_it_is(self, explanation: Explanation) -> Excess | None:
        """Return what the given model leaves; None if its rigid body is not fitted anew."""
        if not frees_body(explanation.base, explanation.given):
            return None
        return self._of_whole(self.given, explanation.evidence)

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

    def _of_rest(self, fit: Explanation) -> list[Excess]:
        """Return what a fit leaves of the data, in all and in the worst second."""
        left, before, arm = self._of_data(fit), self.before, fit.fitted.arm
        if before is None:
            return left
        parts = self._parts(fit.evidence)
        return left + [for_a_second(arm, p, before, self.given, self.settings) for p in parts]

    def _of_data(self, fit: Explanation) -> list[Excess]:
        """Return what a fit leaves of the data, and of those that nothing was fitted to."""
        left = [self._of_whole(fit.fitted.arm, fit.evidence)]
        if self.unseen is not None:
            more, where = self.settings.thresholds.predicted, 'recordings that were not used'
            unseen = self._sure(self.unseen)
            left.append(excess_of(fit.fitted.arm, unseen, self.settings, more, where))
        return left

    def _of_whole(self, arm: ArmModel, evidence: Evidence) -> Excess:
        """Return what an arm leaves of the data: a misfit varies from motion to motion."""
        usual = 1.0 if self.chosen.measured else self.settings.thresholds.predicted
        return excess_of(arm, self._sure(evidence), self.settings, usual)

    def _sure(self, evidence: Evidence) -> Evidence:
        """Return data in units of noise if the misfit is only estimated, which excuses nothing."""
        if self.chosen.floor_in_words != ESTIMATED:
            return evidence
        return replace(evidence, sigma=evidence.noise)
