# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""diagnosis.json, schema armid/diagnosis/1."""

from __future__ import annotations

import math
from typing import Any

from armid_ros.diagnosis.result import Diagnosis
from armid_ros.diagnosis.search.trial import Trial
from armid_ros.diagnosis.verdict.detectable import detectable, smallest_size
from armid_ros.diagnosis.verdict.finding import Finding
from armid_ros.identification.fitting.identifiability import HALF_WIDTH
from armid_ros.motion import FloatArray
import numpy as np

SCHEMA = 'armid/diagnosis/1'

#: Candidates that are listed.
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
        'effects': [_finding(finding) for finding in diagnosis.findings],
        'minor': [_finding(finding) for finding in diagnosis.minor],
        'baseline': diagnosis.baseline,
        'where': [
            {'joint': w.joint, 'share_of_gap': w.share_of_gap, 'signature': w.signature}
            for w in diagnosis.where
        ],
        'gap': _gap(diagnosis),
        'filters': _filters(diagnosis),
        'candidates': _candidates(diagnosis),
        'not_visible': list(diagnosis.not_visible),
        'detectable': _detectable(diagnosis),
        'model': model,
    }


def _finding(finding: Finding) -> dict[str, Any]:
    rows = zip(finding.parameters, finding.values, finding.std, strict=True)
    return {
        'name': finding.name,
        'joints': list(finding.joints),
        'share': finding.share,
        'share_interval': list(finding.share_interval),
        'p': finding.p,
        'parameters': [
            {'name': p.name, 'joint': p.joint, 'value': v, 'std': _finite(std), 'unit': p.unit}
            for p, v, std in rows
        ],
        'ambiguous_with': list(finding.ambiguous_with),
        'rivals': [{'name': r.name, 'joints': list(r.joints)} for r in finding.rivals],
        'experiment': finding.experiment,
        **_ties(finding),
    }


def _ties(finding: Finding) -> dict[str, Any]:
    """Return where a finding ends at another machine, and the intervals of its stiffnesses."""
    if not finding.ties:
        return {}
    rows = []
    for tie in finding.ties:
        _, value, std = finding.values_of(tie.joint)[0]
        rows.append(
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


def _filters(diagnosis: Diagnosis) -> dict[str, float] | None:
    """Return how recordings were filtered, rates and frequencies in Hz; None of bad data."""
    if not diagnosis.data:
        return None
    used = diagnosis.data[0].used
    return {
        'cutoff_hz': used.cutoff_hz,
        'rows_hz': used.rate_hz / used.decimation,
        'kept_hz': used.kept_hz,
    }


def _candidates(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return what was looked at first, in the order in which it was decided."""
    explanation = diagnosis.explanation
    survey = None if explanation is None else explanation.survey
    if survey is None:
        return []
    return [
        _candidate(trial, survey.total, survey.tried)
        for trial in survey.ranking[:_MOST_CANDIDATES]
    ]


def _candidate(trial: Trial, total: float, tried: int) -> dict[str, Any]:
    return {
        'name': trial.candidate.effect.said_as,
        'joints': list(trial.candidate.effect.joints),
        'share': min(trial.gain / max(total, 1e-300), 1.0),
        'held_out_gain': trial.gain,
        'replicated_in': trial.replicated,
        'visible_fraction': trial.visible,
        'min_detectable': _finite(smallest_size(trial)[1]),
        'adjusted_p': min(1.0, trial.p * tried),
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


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
