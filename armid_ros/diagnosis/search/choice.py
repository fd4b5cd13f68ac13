# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which explanation is given: of the model as given, or of a body that is fitted anew.

A fit of the whole body has fifty values, and explains a little more of anything. It is the rival
of last resort: a few causes in the model as given go before it where they explain as much, and
where there are recordings from before, no cause is named that a body common to both days explains.

"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.prepare import Prepared
from armid_ros.diagnosis.search.explain import explain, Explanation, View
from armid_ros.diagnosis.search.fit import fit
from armid_ros.diagnosis.search.held_out import held_out
from armid_ros.diagnosis.search.question import as_given, fitted_anew, Question
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np

Progress = Callable[[float, str], None]

NOISE, ESTIMATED = 'noise', 'an estimate of the misfit that such a model has'
OWN_MISFIT = 'the misfit that the model had before'
WRITTEN_MISFIT = 'the misfit that the model had when it was identified'


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

    """

    explanation: Explanation
    misfit: FloatArray
    floor_in_words: str
    notes: tuple[str, ...] = ()


def explained(
    arm: ArmModel,
    prepared: Prepared,
    baseline: Baseline | None,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    tell: Progress,
    written: FloatArray | None = None,
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

    """
    if baseline is not None:
        return _since(arm, prepared, baseline, settings, rng, tell)
    if written is not None:
        return _beside(arm, prepared, written, settings, rng, tell)
    few, many = settings.thresholds.few_causes, settings.thresholds.many_causes
    given = as_given(arm, prepared.data, few)
    told = Evidence(prepared.data, prepared.as_told, prepared.as_told)
    tell(0.2, 'the model as given')
    first = explain(given, told, settings)
    nothing = np.zeros(arm.robot.n_joints)
    if _at_floor(first, settings):
        return Chosen(first, nothing, NOISE)
    tell(0.4, 'the model fitted anew')
    noise = Evidence(prepared.data, tuple(prepared.sigma), tuple(prepared.sigma))
    anew = explain(fitted_anew(arm, prepared.data, many, rng), noise, settings)
    misfit = _left_by(anew)
    if _at_floor(anew, settings):
        misfit, words = nothing, NOISE
    else:
        tell(0.7, 'the model as given')
        sigma = tuple(np.maximum(one, misfit) for one in prepared.as_told)
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
    noise = prepared.as_told
    evidence = Evidence(prepared.data, tuple(np.maximum(s, misfit) for s in noise), noise)
    given = as_given(arm, prepared.data, 2 * settings.thresholds.few_causes)
    found = explain(given, evidence, settings)
    if _at_floor(found, settings):
        return Chosen(found, misfit, WRITTEN_MISFIT)
    tell(0.6, 'the model fitted anew')
    sigma = tuple(np.maximum(one, misfit) for one in prepared.sigma)
    question = fitted_anew(arm, prepared.data, settings.thresholds.many_causes, rng)
    anew = explain(question, Evidence(prepared.data, sigma, tuple(prepared.sigma)), settings)
    return Chosen(found if _as_good(found, anew, settings) else anew, misfit, WRITTEN_MISFIT)


def _since(
    arm: ArmModel,
    prepared: Prepared,
    baseline: Baseline,
    settings: DiagnosisSettings,
    rng: np.random.Generator,
    tell: Progress,
) -> Chosen:
    """Explain what has changed since the baseline."""
    tell(0.2, 'what has changed')
    noise = prepared.as_told
    sigma = tuple(np.maximum(one, baseline.misfit) for one in noise)
    evidence = Evidence(prepared.data, sigma, noise, baseline.varies)
    given = as_given(arm, prepared.data, 2 * settings.thresholds.few_causes)
    found = explain(given, evidence, settings, baseline=baseline)
    if not found.steps:
        return Chosen(found, baseline.misfit, OWN_MISFIT)
    tell(0.7, 'a body common to both')
    both = _with_before(evidence, baseline)
    anew = fitted_anew(arm, both.data, settings.thresholds.few_causes, rng)
    whole, common = _common_body(arm, evidence, both, anew)
    ahead = found.steps[0].trial.gains - (whole - common)
    if ahead.sum() > settings.thresholds.tie * whole.sum():
        return Chosen(found, baseline.misfit, OWN_MISFIT)
    note = (
        'the baseline did not determine the model for these motions: a rigid body and friction '
        'common to both were fitted'
    )
    return Chosen(explain(anew, both, settings), baseline.misfit, OWN_MISFIT, (note,))


def _with_before(evidence: Evidence, baseline: Baseline) -> Evidence:
    """Return the data with the baseline, in which nothing that is named acts."""
    before = tuple(replace(part, before=True) for part in baseline.data)
    unit = (baseline.misfit,) * len(before)
    return Evidence(
        (*evidence.data, *before),
        (*evidence.sigma, *unit),
        (*evidence.noise, *unit),
        evidence.varies,
    )


def _common_body(
    arm: ArmModel, evidence: Evidence, both: Evidence, anew: Question
) -> tuple[FloatArray, FloatArray]:
    """Return the held-out squares of the model as given, and of one fitted to both, (B,)."""
    common = fit(arm, (), both.data, both.sigma, anew.base)
    problem = View.of(common, both).problem
    free = tuple(range(problem.x.shape[2]))
    _, left = held_out(problem, free, [], common.hold, common.pull)
    alone = fit(arm, (), evidence.data, evidence.sigma, None)
    _, whole = held_out(View.of(alone, evidence).problem, (), [], np.zeros((0, 0)), np.zeros(0))
    return whole, left


def _at_floor(explanation: Explanation, settings: DiagnosisSettings) -> bool:
    evidence = explanation.evidence
    limits = evidence.limits(explanation.fitted.residual, settings)
    return bool(np.all(explanation.losses <= limits))


def _left_by(explanation: Explanation) -> FloatArray:
    """Return the root mean square that an explanation leaves of each joint, (n,) [N m]."""
    evidence = explanation.evidence
    newton_metres = (np.ones_like(evidence.count),) * len(evidence.data)
    return np.sqrt(replace(evidence, sigma=newton_metres).losses(explanation.fitted.residual))


def _as_good(first: Explanation, anew: Explanation, settings: DiagnosisSettings) -> bool:
    """Return whether causes in the model as given explain as much as a body fitted anew."""
    evidence = first.evidence
    left, fitted = first.fitted.residual, anew.fitted.residual
    limits = evidence.limits(left, settings)
    same = settings.thresholds.same_fit * evidence.losses(fitted)
    return bool(np.all(evidence.losses(left) <= np.maximum(limits, same)))
