# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""identification.json: what an identification found, for programs to read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from armid_ros.arm import parameter_table
from armid_ros.identification.identify import Fit, Identification, Score
from armid_ros.motion import FloatArray

SCHEMA = 'armid/identification/1'


def identification_document(
    result: Identification, robot: str, validation: Mapping[str, Sequence[Fit]]
) -> dict[str, Any]:
    """
    Return an identification as the document that identification.json holds.

    Parameters
    ----------
    result : Identification
        The identification.
    robot : str
        Shipped name or path of the description.
    validation : mapping of str to sequence of Fit
        Predictions of recordings that were not used for fitting, by recording.

    """
    estimate = result.estimate
    return {
        'schema': SCHEMA,
        'robot': robot,
        'gravity': [float(g) for g in result.arm.robot.gravity],
        'parameters': parameter_table(estimate.parameters, estimate.values, list(estimate.std)),
        'condition_number': result.condition_number,
        'rank': result.base.rank,
        'training': {
            'bags': list(dict.fromkeys(fit.source for fit in result.training)),
            **_score(result.training),
        },
        'validation': [{'bag': bag, **_score(fits)} for bag, fits in validation.items()],
        'residual_std': _by_joint(result, result.joint_std),
        'settings': {
            'method': result.settings.method,
            'effects': [effect.name for effect in result.arm.effects],
            'rate_hz': result.used.rate_hz,
            'cutoff_hz': result.used.cutoff_hz,
            'decimation': result.used.decimation,
        },
        'notes': list(result.notes),
        'model': 'model.yaml',
    }


def _score(fits: Sequence[Fit]) -> dict[str, Any]:
    score = Score.of(fits)
    joints = fits[0].motion.joints
    return {
        'relative_error_percent': score.relative_error_percent,
        'joint_relative_error_percent': dict(
            zip(joints, score.joint_relative_error_percent.tolist(), strict=True)
        ),
        'rms': dict(zip(joints, score.rms.tolist(), strict=True)),
    }


def _by_joint(result: Identification, values: FloatArray) -> dict[str, float]:
    return dict(zip(result.arm.robot.joints, values.tolist(), strict=True))
