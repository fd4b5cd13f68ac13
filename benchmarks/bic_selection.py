# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What textbook model selection names: the baseline that a diagnosis has to beat.

Forward selection by the Bayesian information criterion on all rows pooled, as if their errors were
independent and alike: no noise floor, nothing held out, no replication. Library, filters, columns
and what is free of the rigid body are those of the diagnosis.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.baseline import excited
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.rows import make_problem, project
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.prepare import choose_filters
from armid_ros.diagnosis.search.candidates import candidates
from armid_ros.diagnosis.search.fit import fit
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
import scipy.linalg

#: Columns of which what is free leaves less than this share add nothing.
_LEAST_VISIBLE = 0.02
#: Directions of a candidate with less than this share of its squares are left at zero.
_DEPENDENT = 1e-9


def bic_selection(
    arm: ArmModel,
    recordings: Sequence[Recording],
    settings: DiagnosisSettings,
    rng: np.random.Generator,
) -> list[Candidate]:
    """
    Return the candidates that lower the criterion, in the order in which they do.

    Parameters
    ----------
    arm : ArmModel
        The arm as described; its rigid body and known effects are free.
    recordings : sequence of Recording
        Data with torques.
    settings : DiagnosisSettings
        Library.
    rng : numpy.random.Generator
        Draws the states over which base parameters are found.

    """
    used = choose_filters(arm, recordings, (), settings, rng)
    data = trajectories(recordings, used)
    base, _ = excited(arm, arm.base_parameters(rng), data)
    one = [np.ones(arm.robot.n_joints)] * len(data)
    reference = fit(arm, (), Evidence.over_noise(data, one), base)
    told = np.concatenate([part.informative for part in data])
    left = np.concatenate(reference.residual)
    alike = [np.sqrt(np.sum(left**2, axis=0, where=told) / told.sum(axis=0))] * len(data)
    found = candidates(reference, Evidence.over_noise(data, alike), settings.kinds)
    columns = [
        np.concatenate(c, axis=2) for c in zip(found.columns, reference.columns, strict=True)
    ]
    problem = make_problem(data, alike, reference.residual, columns)
    size = problem.x.shape[2]
    free = list(range(size - reference.columns[0].shape[2], size))
    rows = int(problem.used.sum())
    flat = problem.x.reshape(-1, size)
    whole = np.einsum('ij,ij->j', flat, flat)
    chosen: list[Candidate] = []
    while True:
        projection = project(problem, free)
        left = projection.rest(problem.y).ravel()
        rest = projection.products(np.column_stack([flat, problem.y.ravel()]))
        rest[-1, -1] = left @ left
        best, candidate = _best(rest, whole, found.candidates, rows)
        if candidate is None or best >= 0.0:
            return chosen
        chosen.append(candidate)
        free += range(candidate.columns.start, candidate.columns.stop)


def _best(
    rest: FloatArray, whole: FloatArray, candidates: Sequence[Candidate], rows: int
) -> tuple[float, Candidate | None]:
    """Return the largest change of the criterion, and the candidate that makes it."""
    best, chosen = 0.0, None
    squares = float(rest[-1, -1])
    for candidate in candidates:
        span = candidate.columns
        own, aim = rest[span, span], rest[span, -1]
        if np.trace(own) < _LEAST_VISIBLE**2 * whole[span].sum() or np.trace(own) <= 0.0:
            continue
        values = scipy.linalg.lstsq(own, aim, cond=_DEPENDENT)[0]
        after = max(squares - float(values @ aim), 1e-300)
        change = rows * np.log(after / squares) + candidate.size * np.log(rows)
        if change < best:
            best, chosen = change, candidate
    return best, chosen
