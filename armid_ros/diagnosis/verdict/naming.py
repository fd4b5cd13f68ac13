# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Findings of a diagnosis: fitted causes as effects of the catalogue, with values and rivals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.search.cause import bounds_of_change, NamedEffect
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.joint_fit import parameter_ranges
from armid_ros.diagnosis.search.ranking import CauseResult
from armid_ros.diagnosis.verdict.attribution import Attribution
from armid_ros.diagnosis.verdict.bodies import is_same_body
from armid_ros.diagnosis.verdict.finding import Finding, Rival
from armid_ros.effects import Effect
from armid_ros.effects.tied import Tied
from armid_ros.estimate import ParameterName
from armid_ros.identification.fitting.identifiability import excludes_zero
from armid_ros.motion import FloatArray
import numpy as np


class _Translation(NamedTuple):
    """Catalogue effect that is equivalent to a fitted cause, with its parameters and values."""

    effect: Effect
    parameters: tuple[ParameterName, ...]
    values: FloatArray
    std: FloatArray


def findings(
    explanation: Explanation,
    attribution: Attribution,
    arm: ArmModel,
    rng: np.random.Generator,
) -> tuple[Finding, ...]:
    """
    Return a finding for each named effect, the largest explained share first.

    Findings that stand for the same cause have a common share.

    """
    translated = _in_catalogue(explanation, arm)
    known = zip(explanation.given.parameters, explanation.given.theta.tolist(), strict=True)
    given = {(parameter.name, parameter.joint): value for parameter, value in known}
    merged: dict[str, list[int]] = {}
    for index, parts in enumerate(translated):
        for part in parts:
            merged.setdefault(part.effect.name, []).append(index)
    result = []
    for name, own in merged.items():
        together = [other for other, where in merged.items() if set(own) & set(where)]
        indices = sorted({k for other in together for k in merged[other]})
        parts = [part for k in indices for part in translated[k] if part.effect.name == name]
        effect, steps = parts[0].effect, [explanation.steps[k] for k in own]
        joints = _joints([part.effect.joints for part in parts], arm)
        order = [joint for joint in (*arm.robot.all_joints, '') if joint in (*joints, '')]
        sums: dict[ParameterName, tuple[float, float]] = {}
        for part in parts:
            for parameter, value, std in zip(part.parameters, part.values, part.std, strict=True):
                if np.isfinite(std):
                    before, wide = sums.get(parameter, (0.0, 0.0))
                    sums[parameter] = before + float(value), float(np.hypot(wide, std))
        names = sorted(sums, key=lambda p: order.index(p.joint) if p.joint in order else 0)
        tied = [part.effect for part in parts if isinstance(part.effect, Tied)]
        ties = {tie.joint: tie for one in tied for tie in one.ties}
        look_at = explanation.fitted.named[own[0]].effect.traits.look_at
        result.append(
            Finding(
                name,
                joints,
                tuple(names),
                tuple(sums[parameter][0] for parameter in names),
                tuple(sums[parameter][1] for parameter in names),
                share=attribution.share(indices),
                share_interval=attribution.interval(indices, rng),
                p=max(trial.p for trial in steps),
                rivals=_rivals(steps, Rival(name, joints), set(merged) - {name}, arm),
                sign=effect.traits.sign,
                ties=tuple(ties[joint] for joint in order if joint in ties),
                weighs=effect.traits.weighs,
                together=tuple(other for other in together if other != name),
                added_to=tuple(given.get((p.name, p.joint), 0.0) for p in names),
                look_at=look_at if len(together) > 1 else '',
                probability=min(trial.probability for trial in steps),
            )
        )
    return tuple(sorted(result, key=lambda one: -one.share))


def minor_findings(explanation: Explanation) -> tuple[Finding, ...]:
    """
    Return findings of significant but negligible causes, the likeliest first.

    Causes with a value significantly outside its bounds are left out.

    """
    arm, result = explanation.given, []
    for trial in sorted(explanation.minor, key=lambda trial: -trial.gain):
        effect, kept = trial.effect, list(trial.kept)
        lower, upper = (bound[kept] for bound in bounds_of_change(effect, arm))
        beyond = (trial.values < lower) | (trial.values > upper)
        if np.any(beyond & excludes_zero(trial.values, trial.std)):
            continue
        names = effect.parameters(arm.robot)
        result.append(
            Finding(
                effect.name,
                effect.joints,
                tuple(names[k] for k in kept),
                tuple(trial.values.tolist()),
                tuple(trial.std.tolist()),
                trial.share,
                (trial.share, trial.share),
                trial.p,
                probability=trial.probability,
                sign=effect.traits.sign,
                weighs=effect.traits.weighs,
            )
        )
    return tuple(result)


def _in_catalogue(explanation: Explanation, arm: ArmModel) -> list[list[_Translation]]:
    """Return for each fitted cause the equivalent effects of the catalogue."""
    fitted, estimate = explanation.fitted, explanation.fitted.estimate
    result = []
    for own, (kept, shapes) in zip(fitted.named, parameter_ranges(fitted.named), strict=True):
        span = slice(kept.start, shapes.stop)
        covariance = estimate.covariance[span, span]
        translations = own.effect.named_as(own.values, arm)
        if len(translations) == 1 and translations[0][0] is own.effect:
            std = np.sqrt(np.diag(covariance))
            rows = estimate.parameters[span], estimate.values[span], std
            result.append([_Translation(own.effect, *rows)])
            continue
        parts = _translated(own, covariance, arm)
        result.append([part for part in parts if _is_significant(part)] or parts[:1])
    return result


def _translated(own: NamedEffect, covariance: FloatArray, arm: ArmModel) -> list[_Translation]:
    """Convert an effect to equivalent effects of the catalogue, with standard deviations."""
    effect, kept, values, parts = own.effect, list(own.kept), own.values, []
    inside = np.zeros((len(values), len(values)))
    inside[np.ix_(kept, kept)] = covariance[: len(kept), : len(kept)]
    known = np.isfinite(np.diag(inside))
    inside = np.where(np.outer(known, known), inside, 0.0)
    of_shape = np.sqrt(np.diag(covariance)[len(kept) :])
    step = 1e-4 * np.sqrt(np.maximum(np.diag(inside), 1e-18))
    for position, (word, numbers) in enumerate(effect.named_as(values, arm)):
        slopes = np.column_stack(
            [
                (
                    effect.named_as(values + change, arm)[position][1]
                    - effect.named_as(values - change, arm)[position][1]
                )
                / (2.0 * size)
                for change, size in zip(np.diag(step), step, strict=True)
            ]
        )
        std = np.sqrt(np.diag(slopes @ inside @ slopes.T))
        # a value is not determined if it depends on a fitted value that is not
        std[np.any(np.abs(slopes[:, ~known]) > 1e-6, axis=1)] = np.nan
        names = word.parameters(arm.robot)
        if word.shape:
            names += word.shape_parameters(arm.robot)
            numbers, std = np.append(numbers, word.shape), np.append(std, of_shape)
        parts.append(_Translation(word, names, numbers, std))
    return parts


def _is_significant(part: _Translation) -> bool:
    """Return whether any value exceeds three standard deviations and its smallest typical size."""
    typical = [q.typical[0] if q.typical else 0.0 for q in part.effect.quantities]
    count = len(part.values) - len(part.effect.shape)
    size, std = np.abs(part.values[:count]), part.std[:count]
    return bool(np.any((size > 3.0 * std) & (size > np.array(typical))))


def _rivals(
    trials: Sequence[CauseResult], own: Rival, others: set[str], arm: ArmModel
) -> tuple[Rival, ...]:
    """
    Return the two likeliest rivals of a finding, with their joints.

    The same effect in another joint is a rival as well; effects of other findings are not.

    """
    best: dict[str, list[CauseResult]] = {}
    for one in trials:
        here: dict[str, CauseResult] = {}
        for rival in sorted(one.rivals, key=lambda rival: -rival.probability):
            effect = rival.effect
            if not (effect.name == own.name and set(effect.joints) <= set(own.joints)):
                here.setdefault(effect.name, rival)
        for name in here.keys() - others:
            best.setdefault(name, []).append(here[name])
    likely = {name: max(trial.probability for trial in found) for name, found in best.items()}
    return tuple(
        Rival(
            name,
            _joints([trial.effect.joints for trial in best[name]], arm),
            likely[name],
            all(any(is_same_body(own, one, arm.robot) for own in trials) for one in best[name]),
        )
        for name in sorted(likely, key=lambda name: -likely[name])[:2]
    )


def _joints(groups: Sequence[tuple[str, ...]], arm: ArmModel) -> tuple[str, ...]:
    """Return the joints of several effects, each once, in the arm's order."""
    joints = [joint for group in groups for joint in group]
    if any(len(group) > 1 for group in groups):
        return tuple(dict.fromkeys(joints))
    return tuple(joint for joint in arm.robot.all_joints if joint in joints)
