# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One wrong value of the description, where a fit of all of them explains the data.

A fit of the whole rigid body tells that values are off, not which. Where a single cause does as
well (one link, a payload, gravity, the tilt of the base, the zero of an encoder), that is the
likelier story: it has a tenth of the freedom.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.candidates import candidates
from armid_ros.diagnosis.evidence import Trajectory
from armid_ros.diagnosis.fit import fit
from armid_ros.diagnosis.model_search import Explanation, joint_losses_of, no_worse
from armid_ros.diagnosis.patch import Named
from armid_ros.diagnosis.problem import make_problem, project
from armid_ros.diagnosis.rivals import likelier_body
from armid_ros.diagnosis.search import Step
from armid_ros.diagnosis.selection import (
    excess,
    replicated,
    screen,
    Trial,
    try_group,
    within_bounds,
)
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.motion import FloatArray
import numpy as np

#: Not a change of the body, but of what is said about its posture.
_POSTURE = ('encoder_offset',)
#: Share of what is beyond the noise that the one cause has to take, held out.
_MOST = 0.5


def wrong_body(
    fitted: Explanation,
    described: Explanation,
    arm: ArmModel,
    data: Sequence[Trajectory],
    sigma: Sequence[FloatArray],
    settings: DiagnosisSettings,
) -> Explanation:
    """
    Return the one cause that does what a fit of the rigid body did, or that fit if there is none.

    Parameters
    ----------
    fitted : Explanation
        The fit of all values, with nothing named.
    described : Explanation
        The arm as described, with nothing fitted.
    arm : ArmModel
        The arm as described.
    data : sequence of Trajectory
        The data.
    sigma : sequence of ndarray, shape (n,)
        Noise of each trajectory [N m].
    settings : DiagnosisSettings
        Library and thresholds.

    """
    reference = described.reference
    kinds = [kind for kind in settings.kinds if kind.changes_body or kind.name in _POSTURE]
    found = candidates(reference, data, sigma, kinds)
    problem = make_problem(data, sigma, reference.residual, list(found.columns))
    projection, left = project(problem, ()), problem.y
    total = float(excess(problem, left).sum())
    able: list[Trial] = []
    for score in screen(problem, projection, found.groups, settings.least_visible):
        columns = problem.x[:, :, score.group.columns]
        trial = try_group(problem, projection, score, columns, settings)
        real = trial.gain > _MOST * total and replicated(trial, settings)
        if real and within_bounds(trial.score) and no_worse(trial.losses, fitted.losses, settings):
            able.append(trial)
    if not able:
        return fitted
    able.sort(key=lambda t: (len(t.score.values), float(np.sum((left - t.torque) ** 2))))
    first = likelier_body(able[0], able, arm)
    group = first.score.group
    start = np.zeros(len(group.effect.parameters(arm.robot)))
    start[list(group.kept)] = first.score.values
    patched = fit(arm, [Named(group.effect, group.kept)], data, sigma, None, [start])
    losses = joint_losses_of(patched, data, sigma)
    if not no_worse(losses, fitted.losses, settings):
        return fitted
    rivals = tuple(trial for trial in able if trial is not first)
    step = Step(first, rivals, tuple(able), described.reference_losses, losses)
    return replace(described, fitted=patched, steps=(step,), survey=fitted.survey, losses=losses)
