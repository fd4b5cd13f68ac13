# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which of the causes that were taken one after the other stand beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm.memoized_arm import memoized_arm
from armid_ros.diagnosis.data.evidence import Evidence, Workspace
from armid_ros.diagnosis.search.acceptance import acceptable, beyond_chance, material
from armid_ros.diagnosis.search.fit import fit, Fitted, Start
from armid_ros.diagnosis.search.question import Question
from armid_ros.diagnosis.search.round import Round
from armid_ros.diagnosis.search.trial import Step, Taken, Trial
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
    gains = trial.joint_gains(here.problem, here.own(trial.candidate), here.free)
    return acceptable(trial, here) and material(gains, here, step.misfit_share)


def as_asked(step: Step, here: Round, since: bool) -> Round:
    """Return a round in which a cause is asked for again as it was when it was taken."""
    return replace(here, total=step.total, tried=step.tried, since=since)


def pruned(
    question: Question,
    taken: Sequence[Taken],
    evidence: Evidence,
    settings: DiagnosisSettings,
    change: FloatArray | None = None,
) -> tuple[tuple[Step, ...], Fitted]:
    """
    Fit all names together, and drop those that the others make needless.

    What made a name needless may be dropped after it: each is asked once more beside those that
    stay.

    Returns
    -------
    steps : tuple of Step
        Those of the names that stay.
    fitted : Fitted
        The arm with these names.

    """
    work = Workspace(memoized_arm(question.arm), evidence.data)
    alive, dropped = list(taken), list[Taken]()
    back: list[Step] = []
    while True:
        fitted = fit(
            question.arm,
            [one.named for one in alive],
            evidence.data,
            evidence.sigma,
            question.base,
            Start([one.values for one in alive], change),
            question.prior,
        )
        steps, change = tuple(one.step for one in alive), fitted.change
        rows = zip(fitted.named, steps, fitted.values, strict=True)
        alive = [Taken(*row) for row in rows]
        needless = _needless(fitted, steps, evidence, settings, work, question.since)
        if needless is not None:
            gone = alive.pop(needless)
            if not any(gone.step is step for step in back):
                dropped.append(gone)
            continue
        needed = _needed_after_all(fitted, dropped, evidence, settings, work, question.since)
        if needed is None:
            return steps, fitted
        again = dropped.pop(needed[0])._replace(values=needed[1])
        back.append(again.step)
        alive.append(again)


def _needless(
    fitted: Fitted,
    steps: Sequence[Step],
    evidence: Evidence,
    settings: DiagnosisSettings,
    work: Workspace,
    since: bool,
) -> int | None:
    """Return the name that is likeliest to be chance beside the others; None if all stand."""
    if not steps:
        return None
    weak: list[tuple[tuple[float, float], int]] = []
    view = View.of(fitted, evidence)
    for k, step in enumerate(steps):
        trial, problem, nuisance, power = view.trial_of(k)
        here = Round(evidence, work, settings, problem, nuisance, power=power)
        here = as_asked(step, here, since)
        if trial is None or not stands(replace(step, trial=trial), here):
            weak.append((doubtful(trial), k))
    return max(weak)[1] if weak else None


def _needed_after_all(
    fitted: Fitted,
    dropped: Sequence[Taken],
    evidence: Evidence,
    settings: DiagnosisSettings,
    work: Workspace,
    since: bool,
) -> tuple[int, FloatArray] | None:
    """Return which dropped name takes most beside those that stay, and its values."""
    if not dropped:
        return None
    view = View.of(fitted, evidence, [one.named for one in dropped])
    found: dict[int, Trial] = {}
    for k, one in enumerate(dropped):
        trial, problem, nuisance, power = view.trial_of_more(k)
        here = Round(evidence, work, settings, problem, nuisance, power=power)
        here = as_asked(one.step, here, since)
        if trial is not None and stands(replace(one.step, trial=trial), here):
            found[k] = trial
    if not found:
        return None
    most = max(found, key=lambda k: found[k].gain)
    values = np.zeros_like(dropped[most].values)
    values[list(dropped[most].named.kept)] = found[most].values
    return most, values
