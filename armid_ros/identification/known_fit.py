# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Torque error of a model, as stated in identification.json or by the misfit of model.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from armid_ros.arm.misfit import misfit_of_block
from armid_ros.files import finite
from armid_ros.identification.assess.grade_limits import by_error


@dataclass(frozen=True)
class KnownFit:
    """
    Torque error and grade of a model, as its file states them.

    Attributes
    ----------
    grade : str
        'good', 'poor' or 'unusable'; by the worst joint if the file has no grade.
    reason : str
        Reason of the grade.
    rms : mapping of str to float
        Root mean square residual of each joint [N m]; empty if unknown.
    errors : mapping of str to float
        Residual of each joint over its torque [%].
    recordings : int
        Number of recordings with this residual, at least one.
    as_diagnosed : bool
        Whether it is the misfit of model.yaml, which excludes rows at rest.

    """

    grade: str
    reason: str
    rms: Mapping[str, float]
    errors: Mapping[str, float]
    recordings: int = 1
    as_diagnosed: bool = False

    @property
    def unusable(self) -> bool:
        """Whether the model does not describe the arm."""
        return self.grade == 'unusable'

    def torque(self, joint: str) -> float:
        """Return the rms torque of a joint, zero if unknown [N m]."""
        error = self.errors.get(joint, 0.0)
        return 100.0 * self.rms[joint] / error if error > 0.0 else 0.0


def known_fit(document: Mapping[str, Any]) -> KnownFit | None:
    """
    Read the fit from identification.json or model.yaml; None if absent.

    Raises
    ------
    KeyError, TypeError or ValueError
        If a key or value is missing or wrong.

    """
    if document.get('misfit') is not None:
        known = misfit_of_block(document['misfit'])
        torque = known.torque_rms or {}
        errors = {j: 100.0 * left / torque[j] for j, left in known.rms.items() if torque.get(j)}
        overall = known.relative_error_percent
        reason = _worst(errors, overall, f'{known.data} data')
        grade = by_error(max(errors.values(), default=overall))
        return KnownFit(grade, reason, known.rms, errors, as_diagnosed=True)
    training = document.get('training')
    if not training:
        return None
    rms, errors = (_by_joint(training, key) for key in ('rms', 'joint_relative_error_percent'))
    overall = finite(training['relative_error_percent'], 'an error')
    reasons = document.get('reasons') or [_worst(errors, overall, 'data that it was fitted to')]
    grade = document.get('grade', by_error(max(errors.values(), default=overall)))
    count = max(len(training.get('bags', ())), 1)
    return KnownFit(str(grade), str(reasons[0]), rms, errors, count)


def _worst(errors: Mapping[str, float], overall: float, data: str) -> str:
    """Return a sentence on the joint with the largest error."""
    if not errors:
        return f'Torque error on {data}: {overall:.3g} %.'
    joint = max(errors, key=lambda one: errors[one])
    where = f' (worst joint: {joint})' if len(errors) > 1 else ''
    return f'Torque error on {data}: {errors[joint]:.3g} %{where}.'


def _by_joint(score: Mapping[str, Any], key: str) -> dict[str, float]:
    """Return the values of a score by joint; empty if absent."""
    values = {}
    for joint, value in (score.get(key) or {}).items():
        values[str(joint)] = finite(value, f'{key} of {joint}')
        if values[str(joint)] < 0.0:
            raise ValueError(f'{key} of {joint} is negative')
    return values
