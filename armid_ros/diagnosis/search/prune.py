# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which of the causes that were taken one after the other stand beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.fit import fit, Fitted, Start
from armid_ros.diagnosis.search.held_out import Trial
from armid_ros.diagnosis.search.memoized_arm import memoized_arm
from armid_ros.diagnosis.search.patch import Named
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.refine import Workspace
from armid_ros.diagnosis.search.round import acceptable, beyond_chance, material, Round
from armid_ros.diagnosis.search.step import Step
from armid_ros.diagnosis.search.view import View
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np


def doubtful(trial: Trial | None) -> tuple[float, float]:
    """Return an order of causes: likelier to be chance, and taking less; None is not seen."""
    return (np.inf, np.inf) if trial is None else (trial.p, -trial.gain)


def stands(step: Step, here: Round) -> bool:
    """Return whether a cause, whose columns come first, is there, and matters if it has to."""
    trial = step.trial
    if step.misfit_share is None:
        return beyond_chance(trial, here)
    gains = trial.joint_gains(here.problem, here.own(trial.group), here.free)
    return acceptable(trial, here) and material(gains, here, step.misfit_share)


@dataclass(frozen=True)
class _Dropped:
    """A name that the others made needless."""

    named: Named
    step: Step


def pruned(
    question: Question,
    named: Sequence[Named],
    steps: Sequence[Step],
    values: Sequence[FloatArray],
    evidence: Evidence,
    settings: DiagnosisSettings,
    change: FloatArray | None = None,
) -> tuple[list[Named], list[Step], Fitted]:
    """
    Fit all names together, and drop those that the others make needless.

    What made a name needless may be dropped after it: each is asked once more beside those that
    stay.

    """
    data, sigma = evidence.data, evidence.sigma
    named, steps, values = list(named), list(steps), list(values)
    base, told = question.base, question.told
    work = Workspace(memoized_arm(question.arm), data)
    dropped: list[_Dropped] = []
    back: list[Step] = []
    while True:
        fitted = fit(question.arm, named, data, sigma, base, Start(values, change), told)
        named, values, change = list(fitted.named), list(fitted.values), fitted.change
        needless = _needless(fitted, steps, evidence, settings, work)
        if needless is not None:
            values.pop(needless)
            gone = _Dropped(named.pop(needless), steps.pop(needless))
            if not any(gone.step is step for step in back):
                dropped.append(gone)
            continue
        needed = _needed_after_all(fitted, dropped, evidence, settings, work)
        if needed is None:
            return named, steps, fitted
        own, value = dropped.pop(needed[0]), needed[1]
        back.append(own.step)
        named, steps, values = [*named, own.named], [*steps, own.step], [*values, value]


def _needless(
    fitted: Fitted,
    steps: Sequence[Step],
    evidence: Evidence,
    settings: DiagnosisSettings,
    work: Workspace,
) -> int | None:
    """Return the name that is likeliest to be chance beside the others; None if all stand."""
    weak: list[tuple[tuple[float, float], int]] = []
    view = View.of(fitted, evidence)
    for k, step in enumerate(steps):
        trial, problem, beside, _ = view.trial_of(k)
        here = Round(evidence, work, settings, problem, beside, step.total, step.tried)
        if trial is None or not stands(replace(step, trial=trial), here):
            weak.append((doubtful(trial), k))
    return max(weak)[1] if weak else None


def _needed_after_all(
    fitted: Fitted,
    dropped: Sequence[_Dropped],
    evidence: Evidence,
    settings: DiagnosisSettings,
    work: Workspace,
) -> tuple[int, FloatArray] | None:
    """Return which dropped name takes most beside those that stay, and its values."""
    if not dropped:
        return None
    view = View.of(fitted, evidence, [own.named for own in dropped])
    found: dict[int, Trial] = {}
    for k, own in enumerate(dropped):
        trial, problem, beside, _ = view.trial_of_more(k)
        here = Round(evidence, work, settings, problem, beside, own.step.total, own.step.tried)
        if trial is not None and stands(replace(own.step, trial=trial), here):
            found[k] = trial
    if not found:
        return None
    most = max(found, key=lambda k: found[k].gain)
    effect, kept = dropped[most].named.effect, dropped[most].named.kept
    values = np.zeros(len(effect.parameters(fitted.arm.robot)))
    values[list(kept)] = found[most].values
    return most, values
