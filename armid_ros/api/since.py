# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Misfit and recordings of a model from its identification."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import TypeGuard

from armid_ros.api.arguments import is_model, recordings_of, RobotLike
from armid_ros.api.identification import IdentificationResult
from armid_ros.arm import ArmModel, Misfit
from armid_ros.identification.identified_from import identified_from, require_as_identified
from armid_ros.identification.parameters_file import read_misfit
from armid_ros.recording import Recording
import numpy as np


def misfit_of(arm: RobotLike | IdentificationResult, model: ArmModel) -> Misfit | None:
    """Return the misfit of a model at its identification, if it is known."""
    if isinstance(arm, IdentificationResult):
        return arm.misfit
    return read_misfit(arm, model) if _is_written(arm) else None


def recordings_since(
    arm: RobotLike | IdentificationResult, model: ArmModel, asked: Sequence[Recording]
) -> list[Recording]:
    """Return the recordings of the identification as baseline; none if one is diagnosed."""
    if isinstance(arm, IdentificationResult):
        found = [*arm.recordings, *arm.held_out]
    elif _is_written(arm):
        found = recordings_of(identified_from(arm), model.robot)
    else:
        return []
    for one, other in product(found, asked):
        if np.array_equal(one.t, other.t) and np.array_equal(one.q, other.q):
            return []
    if not isinstance(arm, IdentificationResult):
        require_as_identified(arm)
    return found


def _is_written(arm: RobotLike | IdentificationResult) -> TypeGuard[str | Path]:
    return isinstance(arm, (str, Path)) and is_model(arm)
