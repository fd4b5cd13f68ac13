# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From a comparison of causes to an explanation: the causes that matter, fitted in an arm."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.cause import Cause, SelectedEffect
from armid_ros.diagnosis.search.comparison import Result
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.posterior import JointFit
from armid_ros.diagnosis.search.trial import Key, Step, Survey, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import Effect
from armid_ros.motion import FloatArray
import numpy as np

#: Precision of a value of which nothing is known before.
_UNKNOWN = 1e-12


@dataclass(frozen=True)
class Name:
    """A cause to be fitted, how it was found, and first values of all its parameters."""

    named: SelectedEffect
    step: Step
    values: FloatArray


def explain(
    problem: JointFit,
    evidence: Evidence,
    result: Result,
    settings: DiagnosisSettings,
    unknown: Sequence[Effect] = (),
    known: Sequence[Name] = (),
) -> Explanation:
    """
    Fit the causes that matter.

    Parameters
    ----------
    problem : JointFit
        What values are fitted in.
    evidence : Evidence
        The data.
    result : Result
        What the comparison found.
    settings : DiagnosisSettings
        Which share of a torque matters.
    unknown : sequence of Effect
        Friction and offsets without given values, which are named where they are there.
    known : sequence of Name
        Causes that were named before.

    """
    material = settings.material
    names, small = list(known), list[Trial]()
    values = result.nuisance.means(result.under)
    for one, span in zip(result.accepted, result.nuisance.spans, strict=True):
        rivals = tuple(one.look.worth(other, material) for other in one.tied)
        step = Step(one.look.worth(one.best, material), rivals)
        if _matters(one.best.cause, values[span], result, material):
            names.append(_name(step, one.best.cause, values[span], problem.arm))
        else:
            small.append(step.trial)
    for effect, trial in _open(result, unknown, settings):
        if not np.any(np.abs(trial.values) >= trial.least):
            small += [trial] if trial.odds > settings.thresholds.alarm else []
        elif trial.odds > settings.thresholds.alarm:
            names.append(Name(SelectedEffect(effect, (0,)), Step(trial), trial.values))
    return Explanation(
        problem.arm,
        problem.fit([one.named for one in names], [one.values for one in names]),
        problem.fit(),
        tuple(one.step for one in names),
        survey_of(result, unknown, settings, [one.step.trial.key for one in names]),
        evidence,
        tuple(small),
        problem,
        problem.refits_body,
    )


def _name(step: Step, cause: Cause, values: FloatArray, arm: ArmModel) -> Name:
    whole = np.zeros(len(cause.effect.parameters(arm.robot)))
    whole[list(cause.kept)] = values
    effect, first = cause.effect.when_found(whole)
    kept = cause.kept if effect is cause.effect else tuple(range(len(first)))
    return Name(SelectedEffect(effect, kept), step, first)


def _matters(cause: Cause, values: FloatArray, result: Result, material: float) -> bool:
    """Return whether what a value makes is as large a share of some joint's torque as matters."""
    made = np.max(np.abs(values) * cause.torque, axis=1)
    return bool(np.any(made >= material * result.nuisance.rows.torque))


def _open(
    result: Result, unknown: Sequence[Effect], settings: DiagnosisSettings
) -> Iterator[tuple[Effect, Trial]]:
    """
    Yield friction and offsets without given values, which are fitted with all causes.

    The odds that one is not zero are those of its prior and its posterior at zero (Dickey, The
    weighted likelihood ratio, 1971).

    """
    nuisance = result.nuisance
    rank, turn = nuisance.rank, nuisance.turn
    values, covariance = nuisance.whole(result.under)
    means, spread = turn @ values[:rank], turn @ covariance[:rank, :rank] @ turn.T
    today, joints = np.flatnonzero(nuisance.rows.today).tolist(), nuisance.arm.robot.joints
    back = np.linalg.inv(turn)
    left = float(sum(np.sum(nuisance.rest(values, k) ** 2) for k in today))
    names = [(one.name, one.joint) for one in nuisance.base.parameters]
    for effect in unknown:
        parameter = effect.parameters(nuisance.arm.robot)[0]
        if (parameter.name, parameter.joint) not in names:
            continue
        k = names.index((parameter.name, parameter.joint))
        columns = [nuisance.columns[j][:, :, :rank] @ back[:, k] for j in today]
        square = float(sum(np.sum(x**2) for x in columns))
        count = max(sum(np.count_nonzero(x) for x in columns), 1)
        joint = joints.index(parameter.joint)
        sigma = float(nuisance.rows.sigma[-1][joint])
        rms = sigma * np.sqrt(square / count)
        variance = float(spread[k, k])
        held = max(float(nuisance.described[k, k]), _UNKNOWN)
        odds = 0.5 * (means[k] ** 2 / variance + np.log(held * variance))
        seen = float(np.clip(1.0 - variance * held, 0.0, 1.0))
        yield (
            effect,
            Trial(
                SelectedEffect(effect, (0,)),
                means[k : k + 1],
                np.sqrt([variance]),
                np.array([seen]),
                np.array([settings.material * nuisance.rows.torque[joint] / max(rms, 1e-300)]),
                np.sqrt(seen),
                2.0 * odds,
                odds,
                min(means[k] ** 2 * square / max(left, 1e-300), 1.0),
                len(today),
            ),
        )


def survey_of(
    result: Result,
    unknown: Sequence[Effect],
    settings: DiagnosisSettings,
    named: Collection[Key] = (),
) -> Survey:
    """Return what the first look showed of all causes, those that were named first."""
    look, levels = result.first, settings.thresholds
    ranking = sorted(look.ranking, key=lambda one: one.cause.key not in named)
    best = [look.worth(one, settings.material) for one in ranking]
    others = (look.trial(one, settings.material) for one in look.others)
    every = [*best, *others, *(t for _, t in _open(result, unknown, settings))]
    seen = tuple(one for one in every if one.visible >= levels.least_visible)
    names = {one.effect.said_as for one in seen}
    keys = {one.key[:2] for one in seen}
    known = {effect.name: effect.said_as for effect in result.effects}
    places = dict.fromkeys((effect.name, effect.joints) for effect in result.effects)
    survey = Survey(
        seen,
        frozenset(known.values()) - names,
        tuple((known[name], joints) for name, joints in places if (name, joints) not in keys),
    )
    if result.accepted or not look.nuisance.rows.before:
        return survey
    suspected = next(
        (
            one
            for one in best
            if one.odds > levels.alone
            and one.share >= levels.headline
            and np.any(np.abs(one.values) >= one.least)
        ),
        None,
    )
    unproven = best[0] if best and best[0].gain > 2.0 * levels.alarm else None
    return replace(survey, suspected=suspected, unproven=unproven)
