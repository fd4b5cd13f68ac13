# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which explanation is given: of the model as given, or of a body that is fitted anew.

A fit of the whole body has fifty values, and explains a little more of anything. It is the rival
of last resort: a few causes in the model as given are preferred where they explain as much. With a
baseline, nothing is named that a body common to both days explains.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.arm.misfit import louder
from armid_ros.diagnosis.data.baseline import Baseline, Identified
from armid_ros.diagnosis.data.discrepancy import Discrepancy
from armid_ros.diagnosis.data.evidence import Evidence, torque_rms
from armid_ros.diagnosis.data.trajectory import count_recordings, Trajectory
from armid_ros.diagnosis.prepare import Prepared
from armid_ros.diagnosis.search.candidates import as_given, fitted_anew, Question
from armid_ros.diagnosis.search.explain import explain
from armid_ros.diagnosis.search.explanation import (
    at_floor,
    Chosen,
    ESTIMATED,
    Explanation,
    freedom,
    in_model_as_given,
    NOISE,
)
from armid_ros.diagnosis.search.trial import Step, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
import numpy as np

Progress = Callable[[float, str], None]
OWN_MISFIT = 'the misfit that the model had before'
WRITTEN_MISFIT = 'the misfit that the model had when it was identified'
#: Data are sampled as often as others if their sampling period is not longer by this factor.
_AS_OFTEN = 1.2
#: Note where nothing is known of how well a model was identified.
_AS_EXACT = (
    'values of the model are taken as exact, as identification.json is not beside it: what they '
    'are off by is not in the intervals'
)
#: What would tell a change from a misfit, where there are no or too few recordings.
_NO_BASELINE = (
    'It may be the model error of this motion. Recordings from before (--baseline) exclude that.'
)
_ONE_EACH = (
    'It may be the model error of this motion. Record more than one motion a day to exclude that.'
)


@dataclass(frozen=True)
class Explainer:
    """
    Explains the gap of an arm by effects of a library.

    Attributes
    ----------
    arm : ArmModel
        The arm.
    prepared : Prepared
        The data.
    baseline : Baseline or None
        Recordings from when nothing was wrong.
    rng : numpy.random.Generator
        Draws the states from which base parameters are found.
    tell : callable
        Called with the share that is done and what is being done.
    settings : DiagnosisSettings
        Library and thresholds.
    written : ndarray, shape (n,), or None
        Misfit that the model is known to have, where there is no baseline [N m].
    unseen : sequence of Trajectory
        Further data of the day in question, which nothing is fitted to.
    information : ndarray, shape (P, P), or None
        What is known of the parameters of the model, where there is no baseline.

    """

    arm: ArmModel
    prepared: Prepared
    baseline: Baseline | None
    rng: np.random.Generator
    tell: Progress
    settings: DiagnosisSettings
    written: FloatArray | None = None
    unseen: Sequence[Trajectory] = ()
    information: FloatArray | None = None

    def chosen(self) -> Chosen:
        """Return the explanation that is given of the gap."""
        if self.baseline is not None:
            return self._since(self.baseline)
        if self.written is not None:
            return self._beside(self.written)
        prepared, tell, settings = self.prepared, self.tell, self.settings
        few = settings.thresholds.few_causes
        given = as_given(self.arm, prepared.data, few, settings.library)
        described = prepared.described
        tell(0.2, 'the model as given')
        first = explain(given, described, settings)
        nothing = np.zeros(self.arm.robot.n_joints)
        closed = at_floor(first, settings)
        if closed and not (
            len(first.steps) > 1 and any(_may_correct(step) for step in first.steps)
        ):
            return Chosen(first, nothing, NOISE)
        tell(0.4, 'the model fitted anew')
        anew = self._anew(tuple(prepared.sigma))
        corrected = at_floor(anew, settings)
        if corrected and len(first.steps) > 1 and not _stands(first, anew):
            return Chosen(anew, nothing, NOISE)
        misfit, words = nothing, NOISE
        if not (closed or corrected):
            misfit = np.sqrt(anew.evidence.power(anew.fitted.residual))
            tell(0.7, 'the model as given')
            sigma = tuple(np.maximum(one, misfit) for one in prepared.as_described)
            first = explain(given, replace(described, sigma=sigma), settings)
            words = ESTIMATED
        if _as_good(first, anew, settings):
            return Chosen(first, misfit, words)
        return Chosen(anew, nothing, words)

    def _beside(self, misfit: FloatArray) -> Chosen:
        """
        Explain what has changed since a model was identified, of whose misfit the size is known.

        Another motion makes another misfit, and without the recordings its form is unknown: where
        the residual is within what a model may leave of motions that were not used, nothing is
        named.

        """
        prepared, settings = self.prepared, self.settings
        noise = _noise_within(misfit, prepared, 0.0)
        evidence = Evidence(prepared.data, tuple(np.maximum(s, misfit) for s in noise), noise)
        known = None if self.information is None else Identified(self.information)
        found = self._changes(evidence, misfit, known)
        usual = settings.thresholds.predicted * evidence.as_good(settings)
        before = evidence.chi2_per_row(found.reference.residual)
        if np.all(before <= usual + evidence.matters(settings)):
            found = found.with_nothing_named()
        chosen = Chosen(found, misfit, WRITTEN_MISFIT, untested=_NO_BASELINE)
        if not found.steps:
            return chosen
        notes = (_AS_EXACT,) if known is None else ()
        return replace(chosen, explanation=in_model_as_given(found), rest=found, notes=notes)

    def _anew(self, sigma: tuple[FloatArray, ...]) -> Explanation:
        """
        Explain the data jointly with a rigid body and known effects that are fitted anew.

        A described value may be off by a share of itself. One whose fit is farther off has
        changed: it is held, so that its change is a candidate.

        """
        arm, data, settings = self.arm, self.prepared.data, self.settings
        library = settings.library
        evidence = Evidence(data, sigma, tuple(self.prepared.sigma))
        many = settings.thresholds.many_causes
        question = fitted_anew(arm, data, many, library, self.rng)
        found = explain(question, evidence, settings)
        rigid, described = len(arm.robot.rigid_parameters), arm.theta
        change = np.abs(found.fitted.arm.theta[: len(described)] - described)
        known = (np.arange(len(described)) >= rigid) & (described != 0.0)  # noqa: RUF069 - an effect without a value
        far = change > settings.thresholds.described * np.abs(described)
        changed = np.flatnonzero(known & far)
        if not len(changed):
            return found
        question = fitted_anew(arm, data, many, library, self.rng, changed.tolist())
        return explain(question, evidence, settings)

    def _since(self, baseline: Baseline) -> Chosen:
        """Explain what has changed since the baseline."""
        prepared = self.prepared
        now, then = torque_rms(prepared.data), torque_rms(baseline.data)
        misfit = baseline.misfit * louder(now, then)
        usual = float(np.median([part.period_recorded for part in baseline.data]))
        noise = _noise_within(misfit, prepared, usual)
        sigma = tuple(np.maximum(one, misfit) for one in noise)
        evidence = Evidence(prepared.data, sigma, noise, baseline.varies)
        more = None
        if self.unseen:
            unit = (np.sqrt(np.mean(np.square(sigma), axis=0)),) * len(self.unseen)
            more = Evidence(tuple(self.unseen), unit, unit, baseline.varies)
        found = self._changes(evidence, misfit, baseline, more)
        chosen = Chosen(found, misfit, OWN_MISFIT)
        if not found.steps:
            return chosen
        first = count_recordings(baseline.data)
        second = count_recordings(prepared.data) + count_recordings(self.unseen)
        untested = _ONE_EACH if first == second == 1 else ''
        return replace(
            chosen,
            explanation=in_model_as_given(found),
            rest=found,
            notes=(untested,) if untested else (),
            untested=untested,
        )

    def _changes(
        self,
        evidence: Evidence,
        misfit: FloatArray,
        known: Baseline | Identified | None,
        unseen: Evidence | None = None,
    ) -> Explanation:
        """Explain what has changed, beside what any model of the arm gets wrong."""
        settings = self.settings
        self.tell(0.2, 'what has changed')
        data = [*self.prepared.data, *(() if known is None else known.data)]
        discrepancy = Discrepancy.over(data, settings.thresholds.of_state * misfit, self.arm)
        question = self._since_then(data, known, [discrepancy])
        baseline = known if isinstance(known, Baseline) else None
        found = explain(question, evidence, settings, baseline=baseline, unseen=unseen)
        return replace(found.in_arm(self._since_then(data, known)), beside=question)

    def _since_then(
        self,
        data: Sequence[Trajectory],
        known: Baseline | Identified | None,
        beside: Sequence[Effect] = (),
    ) -> Question:
        """Ask what has changed in an arm whose body and friction are as they were known."""
        arm, library = self.arm, self.settings.library
        most = 2 * self.settings.thresholds.few_causes
        if known is None:
            return replace(as_given(arm, data, most, library, beside), since=True)
        free = fitted_anew(arm, data, most, library, self.rng, beside=beside)
        assert free.base is not None and free.nuisance_base is not None
        prior = nuisance_prior = known.prior(free.arm, free.base)
        if free.unknown:
            nuisance_prior = known.prior(free.nuisance_arm, free.nuisance_base)
        return replace(free, prior=prior, nuisance_prior=nuisance_prior, since=True)


def _noise_within(
    misfit: FloatArray, prepared: Prepared, period_recorded: float
) -> tuple[FloatArray, ...]:
    """
    Return the noise of data beside a misfit that contains noise, each (n,).

    What periods differ by is more where something happens in one of them, which is a gap: noise
    beyond the misfit differs from row to row. Data that were sampled as often have none beyond it.

    """
    return tuple(
        np.minimum(
            sigma,
            misfit
            if part.period_recorded < _AS_OFTEN * period_recorded
            else np.maximum(misfit, floor.rough),
        )
        for sigma, floor, part in zip(
            prepared.as_described, prepared.floors, prepared.data, strict=True
        )
    )


def _may_correct(step: Step) -> bool:
    effect, others = step.trial.candidate.effect, [rival.candidate.effect for rival in step.rivals]
    return effect.traits.corrects or (
        effect.changes_body and any(one.traits.corrects for one in others)
    )


def _stands(first: Explanation, anew: Explanation) -> bool:
    """
    Return whether causes remain causes jointly with a full correction of the description.

    The description is off in more than one of its values if that correction explains the data and
    either leaves out a cause that it does not hide, or hides more than one, a correction among
    them counted. One body that has changed is part of any correction, and so are effects without
    given values.

    """
    assert anew.survey is not None
    there = {step.trial.candidate.key[:2] for step in anew.steps}
    given = zip(first.given.effects, first.given.values, strict=True)
    open_values = {effect.name for effect, values in given if not np.any(values)}
    candidates = [
        step.trial.candidate
        for step in first.steps
        if not step.trial.candidate.effect.traits.corrects
    ]
    gone = {
        candidate.key[:2] for candidate in candidates if candidate.effect.name not in open_values
    } - there
    wrong = any(_is_correction(step.trial, first.given) for step in first.steps)
    seen = {trial.candidate.key[:2] for trial in anew.survey.ranking}
    return gone.isdisjoint(seen) and len(gone) + wrong < 2


def _is_correction(trial: Trial, arm: ArmModel) -> bool:
    """Return whether the values of a cause say that the description is wrong."""
    effect = trial.candidate.effect
    values, std = np.zeros((2, len(effect.parameters(arm.robot))))
    kept = list(trial.candidate.kept)
    values[kept], std[kept] = trial.values, trial.deviation
    return effect.is_correction(values, std, arm)


def _as_good(first: Explanation, anew: Explanation, settings: DiagnosisSettings) -> bool:
    """
    Return whether causes in the model as given explain as much as a body fitted anew.

    Where the body leaves noise, the causes have to leave as little; an assumed noise excuses no
    residual that the body does not leave. Where the body leaves a gap itself, it is preferred only
    if it takes more in addition to the causes than its values cost.

    """
    evidence = first.evidence
    given, fitted = first.fitted.residual, anew.fitted.residual
    after, least = evidence.chi2_per_row(given), evidence.chi2_per_row(fitted)
    more = freedom(anew, settings) - freedom(first, settings)
    alike = settings.thresholds.same_fit * least
    if more >= 0.0:
        alike = alike + evidence.matters(settings)
        if not evidence.assumed:
            alike = np.maximum(alike, evidence.limits(given, settings))
    if np.all(after <= alike):
        return True
    if at_floor(anew, settings):
        return False
    gap = max(float(evidence.count @ evidence.chi2_per_row(first.reference.residual)), 1e-300)
    return float(evidence.count @ (after - least)) <= settings.thresholds.price * more * gap
