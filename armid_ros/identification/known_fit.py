# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How well a model fits, as its file says: identification.json, or the misfit of model.yaml."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from armid_ros.arm.misfit import misfit_of_block
from armid_ros.files import finite
from armid_ros.identification.assess.grade import by_error
import numpy as np


@dataclass(frozen=True)
class KnownFit:
    """
    What a model leaves of the torque, and what it is said to be good for.

    Attributes
    ----------
    grade : str
        'good', 'poor' or 'unusable'; by the worst joint where the file has no grade.
    reason : str
        Why.
    rms : mapping of str to float
        Root mean square residual of each joint; empty where it is not known [N m].
    errors : mapping of str to float
        The same over the torque of the joint [%].
    recordings : int
        How many it was measured on, at least one.
    as_diagnosed : bool
        Whether it is the misfit of model.yaml, which has rows in which joints move alone.

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
        """Return the root mean square torque of a joint, zero where it is not known [N m]."""
        error = self.errors.get(joint, 0.0)
        return 100.0 * self.rms[joint] / error if error > 0.0 else 0.0


def known_fit(document: Mapping[str, Any]) -> KnownFit | None:
    """
    Return what a document of identification.json or model.yaml says of the fit, if it does.

    Raises
    ------
    KeyError, TypeError or ValueError
        If something is missing or wrong.

    """
    if document.get('misfit') is not None:
        known = misfit_of_block(document['misfit'])
        torque = known.torque_rms or {}
        errors = {j: 100.0 * left / torque[j] for j, left in known.rms.items() if torque.get(j)}
        overall = known.relative_error_percent
        reason = _worst(errors, overall, f'{known.data} data')
        grade = by_error(max(errors.values(), default=overall))
        return KnownFit(grade, reason, known.rms, errors, as_diagnosed=True)
    scores = document.get('validation') or [document.get('training')]
    if not scores[0]:
        return None
    held_out = bool(document.get('validation'))
    rms, errors = (_pooled(scores, key) for key in ('rms', 'joint_relative_error_percent'))
    count = len(scores) if held_out else len(scores[0].get('bags', ()))
    overall = max(finite(one['relative_error_percent'], 'an error') for one in scores)
    data = 'held out' if held_out else 'that it was fitted to'
    reasons = document.get('reasons') or [_worst(errors, overall, f'data {data}')]
    grade = document.get('grade', by_error(max(errors.values(), default=overall)))
    return KnownFit(str(grade), str(reasons[0]), rms, errors, max(count, 1))


def _worst(errors: Mapping[str, float], overall: float, data: str) -> str:
    """Say in words how far off the joint is that is predicted worst."""
    if not errors:
        return f'Torque error on {data}: {overall:.3g} %.'
    joint = max(errors, key=lambda one: errors[one])
    where = f' (worst joint: {joint})' if len(errors) > 1 else ''
    return f'Torque error on {data}: {errors[joint]:.3g} %{where}.'


def _pooled(scores: Sequence[Mapping[str, Any]], key: str) -> dict[str, float]:
    """Return the root mean square over recordings of what each says of its joints."""
    rows = [one.get(key) or {} for one in scores]
    shared = [str(joint) for joint in rows[0] if all(joint in row for row in rows)]
    pooled = {}
    for joint in shared:
        values = np.array([finite(row[joint], f'{key} of {joint}') for row in rows])
        if np.any(values < 0.0):
            raise ValueError(f'{key} of {joint} is negative')
        pooled[joint] = float(np.linalg.norm(values) / np.sqrt(len(values)))
    return pooled
