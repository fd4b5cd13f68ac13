# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From a comparison of causes to an explanation: the arm with the fitted material causes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search.cause import NamedEffect
from armid_ros.diagnosis.search.comparison import Result
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.posterior import Fitted, JointFit
from armid_ros.diagnosis.search.trial import Key, Survey, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import Effect
import numpy as np

#: Prior precision of a value without prior knowledge.
_UNKNOWN = 1e-12


def explain(
    problem: JointFit,
    evidence: Evidence,
    result: Result,
    settings: DiagnosisSettings,
    unknown: Sequence[Effect] = (),
    known: tuple[Fitted, Sequence[Trial]] | None = None,
) -> Explanation:
    """
    Fit the material causes.

    Parameters
    ----------
    problem : JointFit
        Data and model in which the values are fitted.
    evidence : Evidence
        The data in the unit of the gap.
    result : Result
        Result of the comparison of causes.
    settings : DiagnosisSettings
        Thresholds, and the share of a torque that is material.
    unknown : sequence of Effect
        Friction and offsets without given values, which are named if significant.
    known : (Fitted, sequence of Trial), optional
        Causes that were named before, with their values.

    """
    robot, material, alarm = problem.arm.robot, settings.material, settings.thresholds.alarm
    fitted, steps = known or (None, ())
    named = list(fitted.named) if fitted else []
    steps, small = list(steps), list[Trial]()
    means = result.nuisance.means(result.under)
    for one, span in zip(result.accepted, result.nuisance.spans, strict=True):
        trial = replace(
            one.look.worth(one.best, material),
            rivals=tuple(one.look.worth(other, material) for other in one.tied),
        )
        cause = one.best.cause
        made = np.max(np.abs(means[span]) * cause.torque, axis=1)
        if not np.any(made >= material * result.nuisance.rows.torque):
            small.append(trial)
            continue
        named.append(cause.at(means[span], robot))
        steps.append(trial)
    there = [trial for trial in _open(result, unknown, settings) if trial.odds > alarm]
    large = {t.effect.name for t in there if np.any(np.abs(t.values) >= t.least)}
    for trial in there:  # fit it in all joints, or its torque biases other values
        if trial.effect.name in large:
            named.append(NamedEffect(trial.effect, trial.kept, trial.values))
            steps.append(trial)
        else:
            small.append(trial)
    return Explanation(
        problem.arm,
        problem.fit(named),
        problem.fit(),
        tuple(steps),
        survey_of(result, unknown, settings, [trial.key for trial in steps]),
        evidence,
        tuple(small),
        problem,
        problem.refits_body,
    )


def _open(
    result: Result, unknown: Sequence[Effect], settings: DiagnosisSettings
) -> Iterator[Trial]:
    """
    Yield friction and offsets without given values, which are fitted with every cause.

    The odds of a nonzero value are the prior density at zero over the posterior density at zero
    (Dickey, The weighted likelihood ratio, 1971).

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
        yield Trial(
            effect,
            (0,),
            means[k : k + 1],
            np.sqrt([variance]),
            np.array([seen]),
            np.array([settings.material * nuisance.rows.torque[joint] / max(rms, 1e-300)]),
            np.sqrt(seen),
            2.0 * odds,
            odds,
            min(means[k] ** 2 * square / max(left, 1e-300), 1.0),
            len(today),
        )


def survey_of(
    result: Result,
    unknown: Sequence[Effect],
    settings: DiagnosisSettings,
    named: Collection[Key] = (),
) -> Survey:
    """Summarise the first comparison of all causes; the named causes come first."""
    look, material = result.first, settings.material
    # The likeliest setting without the causes may hide other causes.
    under = look.nuisance.marginal(result.under.setting)
    look = replace(look, under=under)
    ranking = sorted(look.ranking, key=lambda one: one.cause.key not in named)
    every = [
        *(look.worth(replace(one, under=under), material) for one in ranking),
        *(look.trial(one, material) for one in look.others),
        *_open(result, unknown, settings),
    ]
    seen = tuple(one for one in every if one.visible >= settings.thresholds.least_visible)
    keys = {one.key[:2] for one in seen}
    places = {(effect.name, effect.joints): effect.said_as for effect in result.effects}
    unseen = tuple(
        (said, joints) for (name, joints), said in places.items() if (name, joints) not in keys
    )
    return Survey(seen, unseen)
