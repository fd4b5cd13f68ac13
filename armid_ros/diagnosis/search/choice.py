# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which explanation is given: of the model as given, or of a body that is fitted anew.

A fit of the whole body has fifty values, and explains a little more of anything. It is the rival
of last resort: a few causes in the model as given go before it where they explain as much, and
where there are recordings from before, no cause is named that a body common to both days explains.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence, Trajectory
from armid_ros.diagnosis.data.prepare import Prepared
from armid_ros.diagnosis.data.rows import weighted_rows
from armid_ros.diagnosis.search.explain import explain, Explanation
from armid_ros.diagnosis.search.fit import fit, Start, Told
from armid_ros.diagnosis.search.question import as_given, fitted_anew
from armid_ros.diagnosis.search.round import cost
from armid_ros.diagnosis.search.step import Step
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np

Progress = Callable[[float, str], None]

NOISE, ESTIMATED = 'noise', 'an estimate of the misfit that such a model has'
OWN_MISFIT = 'the misfit that the model had before'
WRITTEN_MISFIT = 'the misfit that the model had when it was identified'

#: Said where only what a model lacks explains the gap, and not what has changed.
_EVER = (
    'the baseline does not tell whether what is named has changed since, or was there and did not '
    'show: the model lacks it'
)


@dataclass(frozen=True)
class Chosen:
    """
    The explanation that is given.

    Attributes
    ----------
    explanation : Explanation
        The explanation.
    misfit : ndarray, shape (n,)
        Misfit that the gap is measured beside; zero where noise is all [N m].
    floor_in_words : str
        What the floor of the gap is.
    notes : tuple of str
        What a reader should know.
    rest : Explanation or None
        The same names beside a body that is common to both days, which tells what they leave.

    """

    explanation: Explanation
    misfit: FloatArray
    floor_in_words: str
    notes: tuple[str, ...] = ()
    rest: Explanation | None = None


def explained(
    arm: ArmModel,
    prepared: Prepared,
    baseline: Baseline | None,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    tell: Progress,
    written: FloatArray | None = None,
    unseen: Sequence[Trajectory] = (),
) -> Chosen:
    """
    Explain the gap of an arm.

    Parameters
    ----------
    arm : ArmModel
        The arm.
    prepared : Prepared
        The data.
    baseline : Baseline or None
        Recordings in which nothing was wrong.
    settings : DiagnosisSettings
        What was asked.
    rng : numpy.random.Generator
        Draws states.
    tell : callable
        Told the share that is done and what is being done.
    written : ndarray, shape (n,), optional
        Misfit that the model is known to have, where there are no recordings of it [N m].
    unseen : sequence of Trajectory
        More data of the same day, which nothing is fitted to.

    """
    if baseline is not None:
        return _since(arm, prepared, baseline, settings, rng, tell, unseen)
    if written is not None:
        return _beside(arm, prepared, written, settings, rng, tell)
    few = settings.thresholds.few_causes
    given = as_given(arm, prepared.data, few, settings.library)
    told = Evidence(prepared.data, prepared.as_described, prepared.as_described)
    tell(0.2, 'the model as given')
    first = explain(given, told, settings)
    nothing = np.zeros(arm.robot.n_joints)
    closed = at_floor(first, settings)
    if closed and not _beside_a_correction(first):
        return Chosen(first, nothing, NOISE)
    tell(0.4, 'the model fitted anew')
    noise = Evidence(prepared.data, tuple(prepared.sigma), tuple(prepared.sigma))
    anew = _anew(arm, noise, settings, rng)
    corrected = at_floor(anew, settings)
    if corrected and len(first.steps) > 1 and not _stands(first, anew):
        return Chosen(anew, nothing, NOISE)
    misfit, words = nothing, NOISE
    if not (closed or corrected):
        misfit = _left_by(anew)
        tell(0.7, 'the model as given')
        sigma = tuple(np.maximum(one, misfit) for one in prepared.as_described)
        first = explain(given, replace(told, sigma=sigma), settings)
        words = ESTIMATED
    if _as_good(first, anew, settings):
        return Chosen(first, misfit, words)
    return Chosen(anew, nothing, words)


def _beside(
    arm: ArmModel,
    prepared: Prepared,
    misfit: FloatArray,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    tell: Progress,
) -> Chosen:
    """
    Explain what is beyond a misfit that is known in numbers alone.

    Without the recordings nobody can say whether a body common to both would do. A body that is
    fitted anew stays the rival of last resort.

    """
    tell(0.2, 'what has changed')
    noise = prepared.as_described
    evidence = Evidence(prepared.data, tuple(np.maximum(s, misfit) for s in noise), noise)
    given = as_given(arm, prepared.data, 2 * settings.thresholds.few_causes, settings.library)
    found = explain(replace(given, since=True), evidence, settings)
    if at_floor(found, settings):
        return Chosen(found, misfit, WRITTEN_MISFIT)
    tell(0.6, 'the model fitted anew')
    sigma = tuple(np.maximum(one, misfit) for one in prepared.sigma)
    anew = _anew(arm, Evidence(prepared.data, sigma, tuple(prepared.sigma)), settings, rng)
    return Chosen(found if _as_good(found, anew, settings) else anew, misfit, WRITTEN_MISFIT)


def _anew(
    arm: ArmModel, evidence: Evidence, settings: DiagnosisSettings, rng: np.random.Generator
) -> Explanation:
    """
    Explain the data beside a rigid body and known effects that are fitted anew.

    A described value may be off by a share of it. One that is fitted to more than that has
    changed, and is asked about as a cause.

    """
    many, library = settings.thresholds.many_causes, settings.library
    found = explain(fitted_anew(arm, evidence.data, many, library, rng), evidence, settings)
    rigid, described = len(arm.robot.rigid_parameters), arm.theta
    change = np.abs(found.fitted.arm.theta[: len(described)] - described)
    known = (np.arange(len(described)) >= rigid) & (described != 0.0)
    changed = np.flatnonzero(known & (change > settings.thresholds.described * np.abs(described)))
    if not len(changed):
        return found
    question = fitted_anew(arm, evidence.data, many, library, rng, changed.tolist())
    return explain(question, evidence, settings)


def _since(
    arm: ArmModel,
    prepared: Prepared,
    baseline: Baseline,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    tell: Progress,
    unseen: Sequence[Trajectory],
) -> Chosen:
    """Explain what has changed since the baseline."""
    tell(0.2, 'what has changed')
    noise = prepared.as_described
    misfit = baseline.misfit * _louder(prepared, baseline)
    sigma = tuple(np.maximum(one, misfit) for one in noise)
    evidence = Evidence(prepared.data, sigma, noise, baseline.varies)
    most = 2 * settings.thresholds.few_causes
    free = fitted_anew(arm, [*prepared.data, *baseline.data], most, settings.library, rng)
    assert free.base is not None and free.beside_base is not None
    told = baseline.told(free.arm, free.base)
    beside = told if free.beside is arm else baseline.told(free.beside, free.beside_base)
    question = replace(free, told=told, beside_told=beside, since=True)
    more = None
    if unseen:
        unit = (np.sqrt(np.mean(np.square(sigma), axis=0)),) * len(unseen)
        more = Evidence(tuple(unseen), unit, unit, baseline.varies)
    found = explain(question, evidence, settings, baseline=baseline, unseen=more)
    notes: tuple[str, ...] = ()
    if not found.steps and not at_floor(found, settings):
        lacking = explain(question, evidence, settings)
        if _most(lacking, settings) and _may_have_been(lacking, baseline, told, settings):
            found, notes = lacking, (_EVER,)
    if not found.steps:
        return Chosen(found, misfit, OWN_MISFIT)
    return Chosen(in_model_as_given(found), misfit, OWN_MISFIT, notes, found)


def _may_have_been(
    found: Explanation, baseline: Baseline, told: Told, settings: DiagnosisSettings
) -> bool:
    """
    Return whether all names may have been there before, and show only now.

    What the baseline was fitted with hides most of a name there. Of the rest less than the misfit
    may be seen in every joint of the baseline, and more in some joint of the data.

    """
    data, sigma = found.evidence.data, found.evidence.sigma
    for step in found.steps:
        group, values = step.trial.group, step.trial.values
        own = baseline.columns(found.given, group.effect, group.kept)
        hidden = np.linalg.lstsq(told.columns, own, rcond=1e-10)[0] @ values
        then = (own @ values - told.columns @ hidden).reshape(-1, found.given.robot.n_joints)
        rows = [part.columns(found.given, group.effect)[:, :, list(group.kept)] for part in data]
        pairs = zip(rows, found.reference.columns, strict=True)
        torque = [mine @ values - free @ hidden for mine, free in pairs]
        now = np.concatenate(list(weighted_rows(torque, data, sigma)))
        least = settings.thresholds.misfit_share
        power = np.mean(then**2, axis=0), np.mean(now**2, axis=0)
        if np.any(power[0] > least) or not np.any(power[1] > least):
            return False
    return True


def _most(found: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether names take most of the gap."""
    taken = sum(step.trial.gain / step.total for step in found.steps)
    return taken > settings.thresholds.open_share


def _louder(prepared: Prepared, baseline: Baseline) -> FloatArray:
    """
    Return by how much more torque the data have than the baseline, at least 1, shape (n,).

    What a model gets wrong of an arm grows with what the arm does.

    """
    now, before = (_torque_rms(data) for data in (prepared.data, baseline.data))
    return np.maximum(now / np.maximum(before, 1e-12), 1.0)


def _torque_rms(data: Sequence[Trajectory]) -> FloatArray:
    unit = tuple(np.ones(part.motion.n_joints) for part in data)
    return Evidence(tuple(data), unit, unit).torque_rms


def in_model_as_given(found: Explanation) -> Explanation:
    """Return what the names explain beside a rigid body that stays as it is."""
    arm, evidence, fitted = found.given, found.evidence, found.fitted
    reference = fit(arm, (), evidence.data, evidence.sigma, None)
    alone = fit(
        arm,
        fitted.named,
        evidence.data,
        evidence.sigma,
        None,
        Start(fitted.values),
        known=fitted.estimate,
    )
    return replace(found, base=None, told=None, fitted=alone, reference=reference)


def at_floor(explanation: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether what an explanation leaves is no gap in any joint."""
    evidence = explanation.evidence
    limits = evidence.limits(explanation.fitted.residual, settings)
    return bool(np.all(explanation.chi2_per_row <= limits))


def _beside_a_correction(first: Explanation) -> bool:
    """Return whether one of several causes corrects the description, or another body may."""
    return len(first.steps) > 1 and any(_may_correct(step) for step in first.steps)


def _may_correct(step: Step) -> bool:
    effect, others = step.trial.group.effect, [rival.group.effect for rival in step.rivals]
    return effect.corrects or (effect.changes_body and any(one.corrects for one in others))


def _stands(first: Explanation, anew: Explanation) -> bool:
    """
    Return whether causes are causes beside a full correction of the description as well.

    Where they are not, and that explains the data, it is off in more than one of its values.
    Effects that nobody gave values of are part of the correction.

    """
    there = {step.trial.group.key[:2] for step in anew.steps}
    given = zip(first.given.effects, first.given.values, strict=True)
    open_values = {effect.name for effect, values in given if not np.any(values)}
    return all(
        group.effect.corrects or group.effect.name in open_values or group.key[:2] in there
        for group in (step.trial.group for step in first.steps[1:])
    )


def _left_by(explanation: Explanation) -> FloatArray:
    """Return the root mean square that an explanation leaves of each joint, (n,) [N m]."""
    return np.sqrt(explanation.evidence.power(explanation.fitted.residual))


def _as_good(first: Explanation, anew: Explanation, settings: DiagnosisSettings) -> bool:
    """
    Return whether causes in the model as given explain as much as a body fitted anew.

    Where that leaves noise, they have to leave as little. Where it leaves a gap itself, it has to
    take more beside them than its values cost.

    """
    evidence = first.evidence
    left, fitted = first.fitted.residual, anew.fitted.residual
    after, least = evidence.chi2_per_row(left), evidence.chi2_per_row(fitted)
    same = settings.thresholds.same_fit * least
    if np.all(after <= np.maximum(evidence.limits(left, settings), same)):
        return True
    if at_floor(anew, settings):
        return False
    gap = max(float(evidence.count @ evidence.chi2_per_row(first.reference.residual)), 1e-300)
    price = settings.thresholds.price * _more_freedom(first, anew, settings)
    return float(evidence.count @ (after - least)) <= price * gap


def _more_freedom(first: Explanation, anew: Explanation, settings: DiagnosisSettings) -> float:
    """
    Return how many more values were chosen with a body fitted anew.

    Those of the body are no choice where one of several causes says that the description is wrong
    anyway.

    """
    more = freedom(anew, settings) - freedom(first, settings)
    wrong = any(step.trial.group.effect.corrects for step in first.steps)
    if anew.base is not None and len(first.steps) > 1 and wrong:
        more -= anew.base.rank
    return more


def freedom(explanation: Explanation, settings: DiagnosisSettings) -> float:
    """Return how many values were chosen, those of the rigid body included."""
    body = 0 if explanation.base is None else explanation.base.rank
    return body + sum(cost(step.trial, settings) for step in explanation.steps)
