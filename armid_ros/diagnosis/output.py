# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""diagnosis.json, schema armid/diagnosis/1."""

from __future__ import annotations

import math
from typing import Any

from armid_ros.diagnosis.diagnose import Diagnosis
from armid_ros.diagnosis.selection import Trial
from armid_ros.motion import FloatArray
import numpy as np

SCHEMA = 'armid/diagnosis/1'

#: A group is detectable at this many standard deviations of its values.
_DETECTABLE = 5.0
_MOST_CANDIDATES = 20


def diagnosis_document(diagnosis: Diagnosis, model: str = 'model.yaml') -> dict[str, Any]:
    """
    Return a diagnosis as the document that diagnosis.json holds.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.
    model : str
        File of the patched model, as seen from the document.

    """
    return {
        'schema': SCHEMA,
        'verdict': diagnosis.verdict,
        'summary': diagnosis.summary,
        'effects': [
            {
                'name': finding.name,
                'joints': list(finding.joints),
                'parameters': [
                    {
                        'name': p.name,
                        'joint': p.joint,
                        'value': value,
                        'std': _finite(std),
                        'unit': p.unit,
                    }
                    for p, value, std in zip(
                        finding.parameters, finding.values, finding.std, strict=True
                    )
                ],
                'ambiguous_with': list(finding.ambiguous_with),
                'experiment': finding.experiment,
            }
            for finding in diagnosis.findings
        ],
        'where': [
            {'joint': w.joint, 'share_of_gap': w.share_of_gap, 'signature': w.signature}
            for w in diagnosis.where
        ],
        'gap': _gap(diagnosis),
        'candidates': [_candidate(trial) for trial in _league(diagnosis)],
        'not_visible': list(diagnosis.not_visible),
        'model': model,
    }


def _gap(diagnosis: Diagnosis) -> dict[str, Any]:
    joints = diagnosis.arm.robot.joints
    gap = diagnosis.gap

    def table(values: FloatArray) -> dict[str, float]:
        return {joint: float(v) for joint, v in zip(joints, values, strict=True)}

    if gap is None:
        empty = np.zeros(0)
        nothing = dict.fromkeys(empty.tolist(), 0.0)
        return {
            'unit': 'N m',
            'before': nothing,
            'after': nothing,
            'noise_floor': nothing,
            'closed_fraction': 0.0,
            'data': 'none',
        }
    return {
        'unit': 'N m',
        'before': table(gap.before),
        'after': table(gap.after),
        'noise_floor': table(gap.floor),
        'closed_fraction': gap.closed,
        'data': gap.data,
    }


def _league(diagnosis: Diagnosis) -> tuple[Trial, ...]:
    explanation = diagnosis.explanation
    if explanation is None or explanation.survey is None:
        return ()
    return explanation.survey.league[:_MOST_CANDIDATES]


def _candidate(trial: Trial) -> dict[str, Any]:
    score = trial.score
    return {
        'name': score.group.effect.name,
        'joints': list(score.group.effect.joints),
        'held_out_gain': trial.gain,
        'replicated_in': int(np.sum(trial.z >= 3.0)),
        'visible_fraction': score.visible,
        'min_detectable': _finite(_DETECTABLE * float(score.std[0])),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
