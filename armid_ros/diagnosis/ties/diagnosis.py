# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of an arm that may have been recorded with another machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings
from armid_ros.diagnosis.diagnose import Progress
from armid_ros.diagnosis.ties.ties import diagnose_ties
from armid_ros.effects.tied import Partner
from armid_ros.recording import Recording
import numpy as np


def diagnose_beside(
    arm: ArmModel,
    recordings: Sequence[Recording],
    partner: Partner | None,
    *,
    validate: Sequence[Recording] = (),
    baseline: Sequence[Recording] = (),
    misfit: Misfit | None = None,
    settings: DiagnosisSettings | None = None,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Diagnosis:
    """
    Find what a model lacks, ties to another machine first.

    Parameters
    ----------
    arm : ArmModel
        The given model.
    recordings : sequence of Recording
        The recordings in question, with torques and the motion of the partner.
    partner : Partner or None
        The machine to which the arm may be tied, and where; None diagnoses the arm by itself.
    validate : sequence of Recording
        Recordings that are predicted and not fitted, with the motion of the partner.
    baseline : sequence of Recording
        Recordings from when nothing was wrong.
    misfit : Misfit, optional
        Misfit of the model when it was identified, where there is no baseline to measure it.
    settings : DiagnosisSettings, optional
        Library and thresholds; its partner is replaced by `partner`.
    rng : numpy.random.Generator
        Draws the states over which base parameters are found, and resamplings of the data.
    progress : callable, optional
        Called with the share that is done and what is being done.

    Returns
    -------
    Diagnosis
        Verdict, names, patched model.

    Raises
    ------
    IdentificationError
        If there is nothing to diagnose: no torque, no motion, too short.

    """
    return diagnose(
        arm,
        recordings,
        validate=validate,
        baseline=baseline,
        misfit=misfit,
        settings=replace(settings or DiagnosisSettings(), partner=partner),
        rng=rng,
        progress=progress,
        tied=None if partner is None else diagnose_ties,
    )
