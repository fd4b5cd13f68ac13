# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""diagnosis.json, schema armid/diagnosis/1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
import math
from typing import Any

from armid_ros.diagnosis.detectable import detectable, smallest_size
from armid_ros.diagnosis.diagnose import Diagnosis
from armid_ros.diagnosis.league import Standing
from armid_ros.diagnosis.verdict import Finding
from armid_ros.motion import FloatArray
import numpy as np

SCHEMA = 'armid/diagnosis/1'

_MOST_CANDIDATES = 20
#: Standard deviations to either side of a 95 % interval.
_NORMAL = 1.96


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
                'rivals': [{'name': r.name, 'joints': list(r.joints)} for r in finding.rivals],
                'experiment': finding.experiment,
                **_ties(finding),
                **_sureness(diagnosis.league.of(finding.name)),
            }
            for finding in diagnosis.findings
        ],
        'where': [
            {'joint': w.joint, 'share_of_gap': w.share_of_gap, 'signature': w.signature}
            for w in diagnosis.where
        ],
        'gap': _gap(diagnosis),
        'candidates': [_candidate(s) for s in diagnosis.league.first[:_MOST_CANDIDATES]],
        'not_visible': list(diagnosis.not_visible),
        'detectable': _detectable(diagnosis),
        'pattern': None if diagnosis.pattern is None else asdict(diagnosis.pattern),
        'model': model,
    }


def _ties(finding: Finding) -> dict[str, Any]:
    """Return where a finding ends at another machine, and the intervals of its stiffnesses."""
    if not finding.ties:
        return {}
    rows = []
    for tie in finding.ties:
        _, value, std = finding.of_joint(tie.joint)[0]
        rows.append(
            {
                'segment': tie.name,
                'joint': tie.joint,
                'point': list(tie.point),
                'partner_joint': tie.other_joint,
                'partner_point': list(tie.other_point),
                'stiffness': value,
                'interval': [value - _NORMAL * std, value + _NORMAL * std],
            }
        )
    return {'ties': rows}


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


def _candidate(standing: Standing) -> dict[str, Any]:
    trial, score = standing.trial, standing.trial.score
    return {
        'name': score.group.effect.name,
        'joints': list(score.group.effect.joints),
        'held_out_gain': trial.gain,
        'replicated_in': int(np.sum(trial.z >= 3.0)),
        'visible_fraction': score.visible,
        'min_detectable': _finite(smallest_size(score)[1]),
        **_sureness([standing]),
    }


def _detectable(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return from which size on the data would show each effect; null where at no size."""
    return [
        {
            'name': row.name,
            'joints': list(row.joints),
            'parameter': '' if row.parameter is None else row.parameter.name,
            'min_detectable': _finite(row.size),
            'unit': '' if row.parameter is None else row.parameter.unit,
            'visible_fraction': row.visible,
        }
        for row in detectable(diagnosis.explanation, diagnosis.arm.robot)
    ]


def _sureness(standings: Sequence[Standing]) -> dict[str, float]:
    """Return how sure the least sure of some candidates is."""
    return {
        'adjusted_p': max((s.adjusted_p for s in standings), default=1.0),
        'inclusion': min((s.inclusion for s in standings), default=0.0),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
