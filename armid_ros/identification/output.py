# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Content of identification.json, and the recordings that it names.

These recordings are the baseline of a diagnosis. The file has the size and a digest of each
recording, as another recording may later have the same path.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import hashlib
import json
from pathlib import Path
import re
from typing import Any

from armid_ros.errors import ModelError
from armid_ros.estimate import parameter_table
from armid_ros.files import is_file, json_text, read_text, reading, write_file
from armid_ros.identification.assess.grade import Grade
from armid_ros.identification.assess.verification import Verification
from armid_ros.identification.fitting.instruments import NoiseCheck
from armid_ros.identification.identify import Identification
from armid_ros.identification.rows.regression import Fit, Score
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

SCHEMA = 'armid/identification/1'
#: File that is not part of the digest, as tools rewrite it without a change of the data.
_NOT_DATA = 'metadata.yaml'


def identification_document(
    result: Identification,
    robot: str,
    validation: Mapping[str, Sequence[Fit]],
    verification: Verification | None = None,
    grade: Grade | None = None,
) -> dict[str, Any]:
    """
    Return the content of identification.json.

    Parameters
    ----------
    result : Identification
        Model, estimate and fit.
    robot : str
        Shipped name or path of the description.
    validation : mapping of str to sequence of Fit
        Predictions of held-out recordings, by the path of the recording.
    verification : Verification, optional
        Tests of encoder noise and forward simulation.
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
            'halves_error_percent': result.halves.relative_error_percent,
            'joint_halves_error_percent': _by_joint(
                result, result.halves.joint_relative_error_percent
            ),
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
            'encoder_noise': None if noise is None else _noise(result, noise),
            'forward': [pair.document() for pair in verification.forward],
            'left_out': list(verification.left_out),
        }
    return document


def kinematics_digest(robot: Robot) -> str:
    """
    Return a hexadecimal digest of a robot's kinematics, equal for equivalent descriptions.

    The digest covers names, kinds, axes and placements of joints, and names of links, to a
    micrometre. It does not cover masses and gravity, which may be corrected later.

    """
    digest = hashlib.sha256()
    model = robot.model
    for index, (joint, link) in enumerate(zip(robot.moving, robot.links, strict=True), start=1):
        place = model.jointPlacements[index]
        numbers = np.concatenate([place.rotation.ravel(), place.translation])
        rounded = np.round(numbers, 6) + 0.0  # avoid negative zero
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


def with_digests(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of identification.json with size and digest of each recording."""
    there = [(name, Path(name)) for name in _names(document)]
    rows = [{'bag': name, **_content(path)} for name, path in there if path.exists()]
    return {**document, 'recordings': rows}


def identified_from(path: str | Path) -> tuple[Path, ...]:
    """
    Return the existing paths of the recordings from which a model was identified.

    Parameters
    ----------
    path : str or Path
        Path of model.yaml; the identification.json in its folder names the recordings, held-out
        recordings too. Relative paths start in the working directory, in that folder, or in its
        parent.

    Raises
    ------
    ModelError
        If identification.json cannot be read.

    """
    return tuple(_found(Path(path)))


def require_as_identified(path: str | Path) -> None:
    """
    Raise an error if a recording from which a model was identified has changed since.

    Parameters
    ----------
    path : str or Path
        Path of model.yaml. Recordings without size and digest in identification.json are not
        checked.

    Raises
    ------
    ModelError
        If a recording has changed; the message contains the remedy.

    """
    for recording, known in _found(Path(path)).items():
        if known is not None and _content(recording) != known:
            raise ModelError(
                f'{recording}: this recording has changed since {path} was identified from it. '
                'Name a baseline (--baseline), diagnose without a baseline (--no-baseline), or '
                'identify the arm again'
            )


def _content(path: Path) -> dict[str, Any]:
    """Return a recording's size [bytes] and the digest of the first and last MiB of its files."""
    inside = sorted(path.rglob('*')) if path.is_dir() else [path]
    digest, total = hashlib.sha256(), 0
    end = 1 << 20  # bytes; enough for the time stamps at the beginning and the index at the end
    for file in inside:
        if not file.is_file() or file.name == _NOT_DATA:
            continue
        size = file.stat().st_size
        total += size
        digest.update(f'{size};'.encode())
        with file.open('rb') as stream:
            digest.update(stream.read(end))
            stream.seek(max(end, size - end))
            digest.update(stream.read(end))
    return {'size': total, 'digest': digest.hexdigest()}


def _found(model: Path) -> dict[Path, dict[str, Any] | None]:
    """Return existing recordings from which a model.yaml was identified, and their digests."""
    file = model.with_name('identification.json')
    if not is_file(file):
        return {}
    with reading(file, ModelError):
        document = json.loads(read_text(file, ModelError))
        known = {
            str(row['bag']): {'size': int(row['size']), 'digest': str(row['digest'])}
            for row in document.get('recordings', [])
        }
        starts = (Path(), file.parent, file.parent.parent)
        places = [(name, [start / name for start in starts]) for name in _names(document)]
    return {
        place: known.get(name)
        for name, some in places
        if (place := next((one for one in some if one.exists()), None)) is not None
    }


def _names(document: Mapping[str, Any]) -> list[str]:
    """Return the paths of recordings in identification.json, training data first."""
    validation = (row['bag'] for row in document.get('validation', []))
    return [str(name) for name in (*document['training']['bags'], *validation) if name]


def _noise(result: Identification, noise: NoiseCheck) -> dict[str, Any]:
    """Return the result of the encoder-noise test for identification.json."""
    return {
        'statistic': noise.statistic,
        'degrees_of_freedom': noise.freedom,
        'p_value': noise.p_value,
        'position_noise': _by_joint(result, noise.position_noise),
        'bias': noise.bias.tolist(),
        'bias_std': noise.bias_std.tolist(),
        'largest_bias_in_deviations': float(np.max(np.abs(noise.relative_bias), initial=0.0)),
    }


def _score(result: Identification, fits: Sequence[Fit]) -> dict[str, Any]:
    """Return the torque errors of fits for identification.json."""
    score = Score.of(fits)
    return {
        'relative_error_percent': score.relative_error_percent,
        'joint_relative_error_percent': _by_joint(result, score.joint_relative_error_percent),
        'rms': _by_joint(result, score.rms),
    }


def _by_joint(result: Identification, values: FloatArray) -> dict[str, float]:
    """Return values of the joints, shape (n,), as a dictionary by joint name."""
    return dict(zip(result.arm.robot.joints, values.tolist(), strict=True))
