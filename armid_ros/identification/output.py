# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Document of an identification in the file identification.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import hashlib
from pathlib import Path
import re
from typing import Any

from armid_ros.arm import parameter_table
from armid_ros.files import json_text, write_file
from armid_ros.identification.assess.grade import Grade
from armid_ros.identification.assess.verification import Verification
from armid_ros.identification.identify import Identification
from armid_ros.identification.rows.regression import Fit, Score
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

SCHEMA = 'armid/identification/1'


def identification_document(
    result: Identification,
    robot: str,
    validation: Mapping[str, Sequence[Fit]],
    verification: Verification | None = None,
    grade: Grade | None = None,
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
    verification : Verification, optional
        Further tests of the identification.
    grade : Grade, optional
        Grade of the identification.

    """
    estimate = result.estimate
    document = {
        'schema': SCHEMA,
        'robot': robot,
        'description': {
            'joints': list(result.arm.robot.joints),
            'kinematics': kinematics_digest(result.arm.robot),
        },
        **({} if grade is None else grade.document()),
        'gravity': [float(g) for g in result.arm.robot.gravity],
        'parameters': parameter_table(estimate.parameters, estimate.values, list(estimate.std)),
        'covariance': [row[: k + 1].tolist() for k, row in enumerate(estimate.covariance)],
        'scatter': result.scatter.tolist(),
        'grouping': list(result.base.terms),
        'not_identified': [
            {'name': one.name, 'joint': one.joint, 'unit': one.unit, 'reason': lost.reason}
            for lost in result.unidentified
            for one in [lost.parameter]
        ],
        'condition_number': result.condition_number,
        'rank': result.base.rank,
        'training': {
            'bags': list(dict.fromkeys(fit.source for fit in result.training)),
            **_score(result, result.training),
            'halves_error_percent': result.halves.whole,
            'joint_halves_error_percent': _by_joint(result, result.halves.joints),
        },
        'validation': [{'bag': bag, **_score(result, fits)} for bag, fits in validation.items()],
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
    if result.physical is not None:
        document['physical'] = result.physical.document()
    if verification is not None:
        noise = verification.noise
        document['verification'] = {
            'encoder_noise': None
            if noise is None
            else {
                'statistic': noise.statistic,
                'degrees_of_freedom': noise.freedom,
                'p_value': noise.p_value,
                'position_noise': _by_joint(result, noise.position_noise),
                'bias': noise.bias.tolist(),
                'bias_std': noise.bias_std.tolist(),
                'largest_bias_in_deviations': float(
                    np.max(np.abs(noise.relative_bias), initial=0.0)
                ),
            },
            'forward': [pair.document() for pair in verification.forward],
            'left_out': list(verification.left_out),
        }
    return document


def kinematics_digest(robot: Robot) -> str:
    """
    Return a digest of the joints of a description, in hexadecimal.

    The digest covers names, kinds, axes and placements of joints, and names of links, to a
    micrometre. It does not cover masses and gravity, which may be corrected later.

    """
    digest = hashlib.sha256()
    model = robot.model
    for index, (joint, link) in enumerate(zip(robot.joints, robot.links, strict=True), start=1):
        place = model.jointPlacements[index]
        numbers = np.concatenate([place.rotation.ravel(), place.translation])
        rounded = np.round(numbers, 6) + 0.0  # no negative zero
        kind = model.joints[index].shortname()
        parts = (
            joint,
            link,
            kind,
            str(model.parents[index]),
            ' '.join(f'{x:.6f}' for x in rounded),
        )
        digest.update('\n'.join(parts).encode())
    return digest.hexdigest()[:16]


def write_document(path: str | Path, document: Mapping[str, Any]) -> None:
    """Write a document as JSON, with each row of numbers on one line."""
    text = json_text(document, indent=1)
    rows = re.sub(r'\[\n[^][{}"]*\]', lambda row: ' '.join(row[0].split()), text)
    write_file(path, rows + '\n')


def _score(result: Identification, fits: Sequence[Fit]) -> dict[str, Any]:
    score = Score.of(fits)
    return {
        'relative_error_percent': score.relative_error_percent,
        'joint_relative_error_percent': _by_joint(result, score.joint_relative_error_percent),
        'rms': _by_joint(result, score.rms),
    }


def _by_joint(result: Identification, values: FloatArray) -> dict[str, float]:
    return dict(zip(result.arm.robot.joints, values.tolist(), strict=True))
