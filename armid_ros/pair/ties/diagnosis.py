# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of an arm beside which another machine may have been recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis import diagnose, Diagnosis, DiagnosisSettings
from armid_ros.diagnosis.diagnose import Progress
from armid_ros.effects.tied import Partner
from armid_ros.pair.ties.ties import diagnose_ties
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
    Find what a model lacks, ties to another machine before all else.

    Parameters
    ----------
    arm : ArmModel
        The model as it is believed to be.
    recordings : sequence of Recording
        Data with torques, and with the motion of the partner beside them.
    partner : Partner or None
        What the arm may be tied to, and where; None diagnoses the arm by itself.
    validate : sequence of Recording
        Data that are only predicted, with the motion of the partner.
    baseline : sequence of Recording
        Data from when nothing was wrong.
    misfit : Misfit, optional
        What the model left when it was identified, where there is no baseline to measure it.
    settings : DiagnosisSettings, optional
        Library and thresholds; its partner is replaced by the one given.
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
