# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identified parameters in a file: identification.json, or model.yaml without covariances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
import json
from pathlib import Path
from typing import Any

from armid_ros.arm import ArmModel, load_misfit, Misfit
from armid_ros.arm.misfit import misfit_of_block
from armid_ros.arm.model_file import checked_model
from armid_ros.arm.model_file import SCHEMA as MODEL
from armid_ros.errors import ModelError
from armid_ros.estimate import ParameterName
from armid_ros.files import finite, is_file, load_yaml, read_text, reading
from armid_ros.identification.assess.grade_limits import by_error
from armid_ros.identification.fitting.identifiability import NOT_SHOWN
from armid_ros.identification.fitting.least_squares import scaled_inverse
from armid_ros.identification.output import SCHEMA
from armid_ros.model.base_parameters import symbol
from armid_ros.motion import FloatArray
import numpy as np
import yaml

#: Relative residual below which a base parameter is a linear combination of others.
_MAX_RELATIVE_RESIDUAL = 1e-6
_SCHEMAS = (SCHEMA, MODEL)


@dataclass(frozen=True)
class KnownFit:
    """
    Torque error and grade of a model, read from its identification.json.

    Attributes
    ----------
    grade : str
        'good', 'poor' or 'unusable'; by the worst joint if the file has no grade.
    reason : str
        Reason of the grade.
    misfit : Misfit
        Residual of each joint; empty if unknown.
    recordings : int
        Number of recordings that the residual comes from, at least one.

    """

    grade: str
    reason: str
    misfit: Misfit
    recordings: int = 1

    @property
    def unusable(self) -> bool:
        """Whether the grade of the model is unusable: the model does not describe the arm."""
        return self.grade == 'unusable'


@dataclass(frozen=True)
class ParameterFile:
    """
    Identified parameters of an arm with their uncertainties, read from a file.

    Attributes
    ----------
    source : str
        Path of the file.
    robot : str
        Name of the robot in the file.
    values : mapping of ParameterName to (float, float)
        Value and standard deviation of each identified parameter.
    error_percent : float or None
        Relative torque error on held-out data, or on training data where there is none.
    covariance : ndarray, shape (P, P), or None
        Covariance of the values in their order; None in model.yaml.
    terms : mapping of ParameterName to (mapping of str to float)
        Factors of the standard parameters in each value, if known.
    joints : tuple of str
        Joints of the robot, if known.
    kinematics : str
        Digest of the joints, equal for all descriptions of a robot; empty if unknown.
    scatter : ndarray, shape (K, P)
        Jackknife changes of the values without each of K recordings, whose sum of squares is a
        variance; K is zero if unknown.
    not_shown : frozenset of (name, joint)
        Parameters that the motion did not identify.
    fit : KnownFit or None
        Torque error and grade of the model, if the file is identification.json.

    """

    source: str
    robot: str
    values: dict[ParameterName, tuple[float, float]]
    error_percent: float | None
    covariance: FloatArray | None = None
    terms: Mapping[ParameterName, Mapping[str, float]] = field(default_factory=dict)
    joints: tuple[str, ...] = ()
    kinematics: str = ''
    scatter: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    not_shown: frozenset[tuple[str, str]] = frozenset()
    fit: KnownFit | None = None

    def covariance_of(self, names: Sequence[ParameterName]) -> FloatArray:
        """Return the covariance matrix of the named parameters, shape (p, p)."""
        assert self.covariance is not None
        chosen = self._positions(names)
        return np.asarray(self.covariance[np.ix_(chosen, chosen)])

    def scatter_of(self, names: Sequence[ParameterName]) -> FloatArray:
        """Return the jackknife changes of named parameters, shape (K, p), a row per recording."""
        if not len(self.scatter):
            return np.zeros((0, len(names)))
        return np.asarray(self.scatter[:, self._positions(names)])

    def _positions(self, names: Sequence[ParameterName]) -> list[int]:
        """Return the indices of the named parameters in the covariance matrix."""
        order = {name: position for position, name in enumerate(self.values)}
        return [order[name] for name in names]

    def information(self, parameters: Sequence[ParameterName]) -> FloatArray | None:
        """
        Return the information matrix of P standard parameters of a model, shape (P, P).

        The matrix is zero in directions that the values do not determine, such as effects that the
        file does not have. None if the file has no covariance.

        """
        if self.covariance is None or len(self.terms) < len(self.values):
            return None
        rows = [self.terms[name] for name in self.values]
        grouping = _matrix(rows, [symbol(name) for name in parameters])
        return np.asarray(grouping.T @ scaled_inverse(self.covariance) @ grouping)

    def regrouped_as(self, other: ParameterFile) -> ParameterFile:
        """
        Add base parameters of another file if the parameters of this file determine them.

        A motion with less excitation groups more standard parameters. Its base parameters are
        combinations of the base parameters of a motion with more excitation.

        """
        names = [name for name in other.terms if name not in self.values]
        if self.covariance is None or not names or len(self.terms) < len(self.values):
            return self
        own = [self.terms[name] for name in self.values]
        theirs = [other.terms[name] for name in names]
        keys = list(dict.fromkeys(key for row in (*own, *theirs) for key in row))
        mine, wanted = _matrix(own, keys), _matrix(theirs, keys)
        factors = np.linalg.lstsq(mine.T, wanted.T, rcond=None)[0].T
        remainder = np.linalg.norm(factors @ mine - wanted, axis=1)
        follows = remainder < _MAX_RELATIVE_RESIDUAL * np.linalg.norm(wanted, axis=1)
        factors = np.concatenate([np.eye(len(own)), factors[follows]])
        covariance = factors @ self.covariance @ factors.T
        values = factors[len(own) :] @ [value for value, _ in self.values.values()]
        std = np.sqrt(np.diag(covariance))[len(own) :]
        found = [name for name, sure in zip(names, follows, strict=True) if sure]
        more = {n: (float(v), float(s)) for n, v, s in zip(found, values, std, strict=True)}
        terms = {**self.terms, **{name: other.terms[name] for name in found}}
        return replace(
            self,
            values={**self.values, **more},
            covariance=covariance,
            terms=terms,
            scatter=self.scatter @ factors.T if len(self.scatter) else self.scatter,
        )


def read_parameters(path: str | Path) -> ParameterFile:
    """
    Read identified parameters from a file.

    Parameters
    ----------
    path : str or Path
        Folder of an identification, its identification.json, or a model.yaml.

    Raises
    ------
    ModelError
        If the file cannot be read; the message names the file and the mistake.

    """
    path = Path(path)
    if path.is_dir():
        kept = [path / name for name in ('identification.json', 'model.yaml')]
        found = [file for file in kept if is_file(file)]
        if not found:
            raise ModelError(
                f'{path}: this folder has neither identification.json nor model.yaml; '
                'give the folder that armid identify wrote'
            )
        path = found[0]
    text = read_text(path, ModelError)
    with reading(path, ModelError):
        try:
            document = json.loads(text) if path.suffix == '.json' else load_yaml(text)
        except (ValueError, yaml.YAMLError) as error:
            reason = ' '.join(str(error).split())
            raise ModelError(f'the content is neither JSON nor YAML: {reason}') from error
        if not isinstance(document, dict) or document.get('schema') not in _SCHEMAS:
            raise ModelError(f"the key 'schema' has to be {' or '.join(_SCHEMAS)}")
        document = checked_model(text) if document['schema'] == MODEL else document
        read = parameters_of(str(path), document)
    if document['schema'] != MODEL:
        return read
    return _identification_of(path, document) or read


def _identification_of(path: Path, model: Mapping[str, Any]) -> ParameterFile | None:
    """Read identification.json in the folder of a model.yaml; None unless of this model."""
    # identification.json has the base parameters of the model and their covariance. It is of this
    # model if the model reproduces the value of every base parameter.
    file = path.with_name('identification.json')
    if not is_file(file):
        return None
    with reading(file, ModelError):
        document = json.loads(read_text(file, ModelError))
        if not isinstance(document, dict) or document.get('schema') != SCHEMA:
            return None
        found = parameters_of(str(file), document)
        rows = [*model['rigid_parameters']]
        for effect in model['effects']:
            rows += [*effect['parameters'], *effect.get('shapes', ())]
        names = [ParameterName(str(row['name']), str(row['joint']), '') for row in rows]
        values = {symbol(n): float(row['value']) for n, row in zip(names, rows, strict=True)}
        known = all(key in values for row in found.terms.values() for key in row)
        complete = len(found.terms) == len(found.values) > 0
        if not (complete and known and document.get('gravity') == model['gravity']):
            return None
    for name, row in found.terms.items():
        value, std = found.values[name]
        reproduced = sum(factor * values[key] for key, factor in row.items())
        if abs(reproduced - value) > _MAX_RELATIVE_RESIDUAL * (std + abs(value)):
            return None
    return found


def read_misfit(path: str | Path, arm: ArmModel) -> Misfit | None:
    """
    Read the misfit of a model from a result of armid identify; None if unknown.

    Parameters
    ----------
    path : str or Path
        Path of model.yaml; the identification.json in its folder has the covariance.
    arm : ArmModel
        The model.

    Raises
    ------
    ModelError
        If a file cannot be read; the message names the file and the mistake.

    """
    misfit, file = load_misfit(path), Path(path).with_name('identification.json')
    if misfit is None or not is_file(file):
        return misfit
    known = read_parameters(file)
    unusable = known.fit is not None and known.fit.unusable
    return replace(misfit, information=known.information(arm.parameters), unusable=unusable)


def parameters_of(source: str, document: dict[str, Any]) -> ParameterFile:
    """
    Return the parameters in the content of an identification.json or model.yaml.

    Raises
    ------
    KeyError, TypeError or ValueError
        If a key or value is missing or wrong.

    """
    rows = list(document.get('parameters', document.get('rigid_parameters', [])))
    for effect in document.get('effects', []):
        rows += effect['parameters']
    values: dict[ParameterName, tuple[float, float]] = {}
    for row in rows:
        if 'unit' not in row:
            raise ValueError(
                f"parameter '{row['name']}' of joint '{row['joint']}' has no 'unit'; add this key"
            )
        name = ParameterName(str(row['name']), str(row['joint']), str(row['unit']))
        parameter = f'{name.name} of joint {name.joint}'
        if name in values:
            raise ValueError(f'{parameter} is given twice; remove one of the entries')
        value = finite(row['value'], parameter)
        if row.get('std') is None:
            continue
        values[name] = value, finite(row['std'], f'the std of {parameter}')
        if values[name][1] < 0.0:
            raise ValueError(f'the std of {parameter} is negative: {row["std"]:g}')
    covariance = _covariance(document.get('covariance'), len(values))
    grouping = [
        {str(term): finite(factor, f'the factor of {term}') for term, factor in row.items()}
        for row in document.get('grouping', [])
    ]
    terms = dict(zip(values, grouping, strict=False))
    scores = [*document.get('validation', []), document.get('training')]
    score = next((score for score in scores if score), None)
    error = None
    if score is not None:
        error = finite(score['relative_error_percent'], 'relative_error_percent')
    scatter = [[finite(v, 'a scatter') for v in row] for row in document.get('scatter', ())]
    if any(len(row) != len(values) for row in scatter):
        raise ValueError(f"each row of the key 'scatter' has to have {len(values)} values")
    about = document.get('description', {})
    return ParameterFile(
        source,
        str(document['robot']),
        values,
        error,
        covariance,
        terms,
        tuple(str(joint) for joint in about.get('joints', ())),
        str(about.get('kinematics', '')),
        np.array(scatter).reshape(len(scatter), len(values)),
        frozenset(
            (str(row['name']), str(row['joint']))
            for row in document.get('not_identified', ())
            if row['reason'] == NOT_SHOWN
        ),
        known_fit(document),
    )


def _matrix(rows: Sequence[Mapping[str, float]], keys: Sequence[str]) -> FloatArray:
    """Return a matrix with a row per mapping and a column per key; missing values are zero."""
    return np.array([[row.get(key, 0.0) for key in keys] for row in rows])


def known_fit(document: Mapping[str, Any]) -> KnownFit | None:
    """
    Return torque error and grade from the content of identification.json; None if missing.

    Raises
    ------
    ModelError, KeyError, TypeError or ValueError
        If a key or value is missing or wrong.

    """
    training = document.get('training')
    if not training:
        return None
    rms, shares = (
        {joint: finite(value, f'{key} of {joint}') for joint, value in rows.items()}
        for key in ('rms', 'joint_relative_error_percent')
        for rows in [training.get(key) or {}]
    )
    torque = {j: 100.0 * left / shares[j] if shares.get(j) else 0.0 for j, left in rms.items()}
    misfit = misfit_of_block({**training, 'data': 'training', 'rms': rms, 'torque_rms': torque})
    error = max(shares.values(), default=misfit.relative_error_percent)
    grade = document.get('grade', by_error(error))
    reason = (document.get('reasons') or [f'Torque error on training data: {error:.3g} %.'])[0]
    return KnownFit(str(grade), str(reason), misfit, max(len(training.get('bags', ())), 1))


def _covariance(rows: list[list[float]] | None, size: int) -> FloatArray | None:
    """Return a covariance matrix from the rows of its lower triangle; None if `rows` is None."""
    if rows is None:
        return None
    if [len(row) for row in rows] != list(range(1, size + 1)):
        raise ValueError(f"the key 'covariance' has to be a lower triangle with {size} rows")
    matrix = np.zeros((size, size))
    for index, row in enumerate(rows):
        matrix[index, : index + 1] = matrix[: index + 1, index] = row
    if not np.isfinite(matrix).all():
        raise ValueError('a number of the covariance is not finite; identify the arm again')
    deviations = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    largest = np.outer(deviations, deviations)
    # numbers in the file have 16 digits
    if (np.diag(matrix) < 0.0).any() or (np.abs(matrix) > largest * (1.0 + 1e-9)).any():
        raise ValueError(
            'the covariance has a negative variance, or a correlation above 1; identify again'
        )
    return matrix
