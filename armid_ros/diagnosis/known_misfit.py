# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The misfit of a model that a later diagnosis is to know, measured as a diagnosis measures it."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel, Misfit
from armid_ros.arm.misfit import RowFilters
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import torque_rms
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.identification import Identification
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.recording import Recording
import numpy as np


def known_misfit(
    found: Identification, recordings: Sequence[Recording], held_out: Sequence[Recording] = ()
) -> Misfit:
    """
    Measure what an identified model leaves, of held-out recordings where there are any.

    Parameters
    ----------
    found : Identification
        The model.
    recordings : sequence of Recording
        What it was fitted to.
    held_out : sequence of Recording
        What it was not.

    """
    data = 'held-out' if held_out else 'training'
    return misfit_of(found.arm, held_out or recordings, found.used, data)


def misfit_of(
    arm: ArmModel,
    recordings: Sequence[Recording],
    used: Conditioning,
    data: str,
) -> Misfit:
    """
    Measure what a model leaves of recordings in which nothing is wrong.

    Rows in which a joint rests or turns round do not count: a diagnosis learns nothing from the
    friction there, of which a model gets most wrong.

    Parameters
    ----------
    arm : ArmModel
        The model.
    recordings : sequence of Recording
        The recordings.
    used : Conditioning
        Filters; the narrower the band, the less noise.
    data : {'held-out', 'training'}
        Whether the model was fitted to them.

    Raises
    ------
    IdentificationError
        If a recording is too short for the filters.

    """
    parts = trajectories(recordings, used, arm)
    found = Baseline.of(arm, parts, np.random.default_rng(0))
    rms, torque = (
        dict(zip(arm.robot.joints, each.tolist(), strict=True))
        for each in (found.misfit, torque_rms(parts))
    )
    filters = RowFilters(used.rate_hz, used.cutoff_hz, used.decimation)
    return Misfit(data, rms, 100.0 * found.errors[0], torque, filters=filters)
