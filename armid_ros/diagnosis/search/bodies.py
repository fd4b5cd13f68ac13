# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Links of a fitted arm made bodies, so that it can be simulated.

A fit of base parameters leaves standard ones that no body may have. What the data tell stays: of
all links that are bodies and fit as well, those nearest to the description are taken.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Trajectory
from armid_ros.diagnosis.data.rows import weighted_rows
from armid_ros.diagnosis.search.explanation import Explanation
from armid_ros.errors import IdentificationError
from armid_ros.identification.physical.fit_among_bodies import physical_program, PhysicalSettings
from armid_ros.motion import FloatArray
import numpy as np
import scipy.linalg

#: Weights of the description that are tried, the heaviest that costs nothing is taken.
_WEIGHTS = (1e-3, 1e-5, 1e-7)
#: Bodies that leave this much of what the fit leaves explain as much.
_ALIKE = 1.05


def as_bodies(explanation: Explanation, arm: ArmModel) -> tuple[Explanation, tuple[str, ...]]:
    """
    Return an explanation whose links are bodies, if some explain the data as well, and a note.

    Parameters
    ----------
    explanation : Explanation
        What was found.
    arm : ArmModel
        The arm as described.

    """
    base, fitted = explanation.base, explanation.fitted
    rigid = len(arm.robot.rigid_parameters)
    if base is None or not base.rank or base.independent.min() >= rigid:
        return explanation, ()
    evidence = explanation.evidence
    data, sigma = evidence.data, evidence.sigma
    known = len(arm.parameters)
    values = base.values(fitted.arm.theta[:known])
    triangle, count = _triangle(explanation, values, data, sigma)
    program, _ = physical_program(arm, base, PhysicalSettings())
    for weight in _WEIGHTS:
        try:
            theta = program.solve(triangle, count, weight)
        except IdentificationError:
            continue
        changed = fitted.arm.with_theta(np.concatenate([theta, fitted.arm.theta[known:]]))
        residual = tuple(part.residual(changed) for part in data)
        bodily = replace(fitted, arm=changed, residual=residual)
        allowed = np.maximum(_ALIKE * explanation.chi2_per_row, 1.0)
        if np.all(evidence.chi2_per_row(residual) <= allowed):
            return replace(explanation, fitted=bodily), ()
    return explanation, (
        'no links that are bodies explain the data as well: what was named, or not found, is in '
        'the inertias; the patched model may not be simulable',
    )


def _triangle(
    explanation: Explanation,
    values: FloatArray,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
) -> tuple[FloatArray, float]:
    """
    Return the triangular factor of base columns and what they are to make, and its rows.

    What other data tell of the body counts as rows as well.

    """
    fitted, rank = explanation.fitted, len(values)
    blocks = []
    for columns, left in zip(fitted.columns, fitted.residual, strict=True):
        own = columns[:, :, :rank]
        target = left + own @ values
        blocks.append(np.concatenate([own, target[:, :, np.newaxis]], axis=2))
    factors = [
        scipy.linalg.qr(rows.reshape(-1, rank + 1), mode='r')[0][: rank + 1]
        for rows in weighted_rows(blocks, data, sigma)
    ]
    prior = explanation.prior
    if prior is not None:
        own, left = prior.columns, prior.residual - prior.columns @ fitted.change
        factors.append(np.column_stack([own, left + own @ values]))
    whole = scipy.linalg.qr(np.concatenate(factors), mode='r')[0][: rank + 1]
    return np.asarray(whole), float(sum(part.informative.sum() for part in data))
