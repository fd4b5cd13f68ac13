# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Content of diagnosis.json, with the smallest detectable size of each effect.

Smaller effects may exist without being named.

"""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Any

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.diagnosis.search.ranking import CauseResult
from armid_ros.diagnosis.verdict.finding import Diagnosis, Finding
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.estimate import ParameterName
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.robots import Robot
import numpy as np

SCHEMA = 'armid/diagnosis/1'
#: Detectable size of a value, in its standard deviations. On a two-link arm, effects of one to
#: four times this size were named, and effects of half this size were not.
DETECTABLE_Z = 5.0


def diagnosis_document(diagnosis: Diagnosis, model: str = 'model.yaml') -> dict[str, Any]:
    """
    Return the content of diagnosis.json, schema armid/diagnosis/1.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    model : str
        Path of the patched model, relative to the document.

    """
    explanation = diagnosis.explanation
    filters = None  # of bad data
    if diagnosis.data:
        used = diagnosis.data[0].used
        filters = {
            'cutoff_hz': used.cutoff_hz,
            'rows_hz': used.rate_hz / used.decimation,
            'kept_hz': used.kept_hz,
        }
    return {
        'schema': SCHEMA,
        'verdict': diagnosis.verdict,
        'summary': diagnosis.summary,
        'effects': [_finding(finding) for finding in diagnosis.findings],
        'minor': [_finding(finding) for finding in diagnosis.minor],
        'baseline': diagnosis.baseline,
        'where': [
            {'joint': w.joint, 'share_of_gap': w.share_of_gap, 'signature': w.signature}
            for w in diagnosis.where
        ],
        'gap': _gap(diagnosis),
        'filters': filters,
        'candidates': [] if explanation is None else _candidates(explanation),
        'not_visible': list(diagnosis.not_visible),
        'detectable': [
            {
                'name': row.name,
                'joints': list(row.joints),
                'parameter': '' if row.parameter is None else row.parameter.name,
                'min_detectable': _finite(row.size),
                'unit': '' if row.parameter is None else row.parameter.unit,
                'visible_fraction': row.visible,
            }
            for row in detectable(explanation)
        ],
        'model': model,
        'spans': [
            {'recording': one.source, 'start': one.start, 'stop': one.stop}
            for one in diagnosis.spans
        ],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    rows = zip(finding.parameters, finding.values, finding.std, strict=True)
    ties = []
    for tie in finding.ties:
        _, value, std, _ = next(row for row in finding.rows if row[0].joint == tie.joint)
        ties.append(
            {
                'segment': tie.name,
                'joint': tie.joint,
                'point': list(tie.point),
                'partner_joint': tie.other_joint,
                'partner_point': list(tie.other_point),
                'stiffness': value,
                'interval': [value - HALF_WIDTH * std, value + HALF_WIDTH * std],
            }
        )
    return {
        'name': finding.name,
        'joints': list(finding.joints),
        'share': finding.share,
        'share_interval': list(finding.share_interval),
        'p': finding.p,
        'probability': finding.probability,
        'parameters': [
            {'name': p.name, 'joint': p.joint, 'value': v, 'std': _finite(std), 'unit': p.unit}
            for p, v, std in rows
        ],
        'ambiguous_with': list(finding.ambiguous_with),
        'rivals': [
            {
                'name': r.name,
                'joints': list(r.joints),
                'probability': r.probability,
                'same_body': r.same_body,
            }
            for r in finding.rivals
        ],
        'experiment': finding.experiment,
        **({'ties': ties} if ties else {}),
    }


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    joints, units = diagnosis.arm.robot.joints, diagnosis.arm.robot.torque_units
    gap = diagnosis.gap
    data = 'held-out' if gap and gap.predicted else 'the data it was found in'

    def table(name: str) -> dict[str, float]:
        rows = [] if gap is None else zip(joints, getattr(gap, name), strict=True)
        return {joint: float(value) for joint, value in rows}

    return {
        'unit': 'N m' if 'N m' in units else units[0],
        'units': dict(zip(joints, units, strict=True)),
        'before': table('before'),
        'after': table('after'),
        'noise_floor': table('floor'),
        'closed_fraction': gap.closed if gap else 0.0,
        'data': data if gap else 'none',
    }


def _candidates(explanation: Explanation) -> list[dict[str, Any]]:
    """Return the first 20 causes for diagnosis.json: named ones, then the likeliest others."""
    return [
        {
            'name': trial.effect.name,
            'joints': list(trial.effect.joints),
            'share': trial.share,
            'held_out_gain': trial.gain,
            'replicated_in': trial.replicated,
            'visible_fraction': trial.visible,
            'min_detectable': _finite(_detectable_size(trial, explanation.given)[1]),
            'adjusted_p': trial.p,
        }
        for trial in explanation.candidates[:20]
    ]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


@dataclass(frozen=True)
class Detectable:
    """
    Smallest size of an effect that the data would reveal.

    Attributes
    ----------
    name : str
        Name of the effect.
    joints : tuple of str
        Joints on which it acts; empty for the whole arm.
    parameter : ParameterName or None
        Parameter whose size it is; None if no size is detectable.
    size : float
        Smallest detectable size if all parameters are fitted jointly; inf if there is none.
    visible : float
        Share of its torque that the nuisance parameters cannot reproduce.

    """

    name: str
    joints: tuple[str, ...]
    parameter: ParameterName | None
    size: float
    visible: float


def _detectable_size(trial: CauseResult, arm: ArmModel) -> tuple[ParameterName, float]:
    """
    Return a cause's first identifiable parameter, and its smallest detectable size.

    A detectable size is significant and material. It is inf if no possible size is detectable.

    """
    effect, names = trial.effect, trial.effect.parameters(arm.robot)
    rows = zip(trial.kept, trial.std, trial.resolution, trial.least, strict=True)
    for index, std, resolution, least in rows:
        size = max(DETECTABLE_Z * float(std), float(least))
        # two inseparable values have a resolution of at most 0.5 each
        if resolution <= 0.9 or not is_possible(effect, index, size, arm.robot):
            continue
        values = np.where(np.arange(len(names)) == index, size, 0.0)
        for named, translated in effect.named_as(values, arm):
            largest = int(np.argmax(np.abs(translated)))
            own_size = float(abs(translated[largest]))
            wanted = named.name == effect.name and own_size > 0.0
            if wanted and is_possible(named, largest, own_size, arm.robot):
                return named.parameters(arm.robot)[largest], own_size
    return names[trial.kept[0]], float('inf')


def is_possible(effect: Effect, index: int, size: float, robot: Robot) -> bool:
    """
    Return whether a robot can physically have this value of an effect parameter.

    It must not exceed the largest value of its quantity. A detectable size of a million typical
    values means that the motion excites the effect less than rounding errors do.

    """
    owner, which = divmod(index, len(effect.quantities))
    quantity = effect.quantities[which]
    largest = quantity.typical[1] if quantity.typical else 1.0
    return size <= quantity.largest(effect.owners[owner], robot) and 1e-6 * size < largest


def detectable(explanation: Explanation | None) -> tuple[Detectable, ...]:
    """Return the smallest detectable size of each effect on each joint."""
    if explanation is None:
        return ()
    rows = []
    for trial in explanation.candidates:
        effect = trial.effect
        parameter, size = _detectable_size(trial, explanation.given)
        rows.append(Detectable(effect.name, effect.joints, parameter, size, trial.visible))
    rows += [
        Detectable(name, joints, None, float('inf'), 0.0) for name, joints in explanation.invisible
    ]
    order = {name: position for position, name in enumerate(CATALOGUE)}
    return tuple(sorted(rows, key=lambda row: order.get(row.name, len(order))))
