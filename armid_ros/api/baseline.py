# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The model that is diagnosed, its misfit, and its baseline recordings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

from armid_ros.api.arguments import arm_of, is_model, RecordingLike, recordings_of, Rng, RobotLike
from armid_ros.api.identification import IdentificationResult, identify
from armid_ros.arm import ArmModel, Misfit
from armid_ros.effects import CATALOGUE
from armid_ros.errors import IdentificationError
from armid_ros.identification.output import identified_from, require_as_identified
from armid_ros.identification.parameters_file import read_misfit
from armid_ros.recording import Recording
from armid_ros.simulation.plant import require_any_mass
import numpy as np


def baseline_recordings(
    arm: RobotLike | IdentificationResult,
    model: ArmModel,
    baseline: RecordingLike | Sequence[RecordingLike] | None,
    diagnosed: Sequence[Recording],
) -> list[Recording]:
    """
    Return the baseline recordings; by default, the recordings used to identify the model.

    The default baseline is empty if one of its recordings is diagnosed.

    """
    if baseline is not None:
        return recordings_of(baseline, model.robot)
    if isinstance(arm, IdentificationResult):
        found = [*arm.recordings, *arm.held_out]
    elif isinstance(arm, str | Path) and is_model(arm):
        found = recordings_of(identified_from(arm), model.robot)
    else:
        return []
    for one, other in product(found, diagnosed):
        if np.array_equal(one.t, other.t) and np.array_equal(one.q, other.q):
            return []
    if not isinstance(arm, IdentificationResult):
        require_as_identified(arm)
    return found


def diagnosed_model(
    arm: RobotLike | IdentificationResult,
    effects: str,
    against: RecordingLike | Sequence[RecordingLike],
    baseline: RecordingLike | Sequence[RecordingLike] | None,
    rng: Rng,
) -> tuple[RobotLike | IdentificationResult, ArmModel, Misfit | None, IdentificationResult | None]:
    """
    Return the arm to diagnose, its model and misfit, and a simulator's identification or None.

    Without recordings of a simulator (`against`), the last result is None.

    The misfit is that of the model at its identification; None if it is unknown. The model of a
    simulator is identified from its recordings. Without given effects, it has the usual effects,
    and those that an MJCF can describe.

    """
    model = arm.arm if isinstance(arm, IdentificationResult) else arm_of(arm, effects)
    require_any_mass(model.robot)
    recordings = recordings_of(against, model.robot)
    if not recordings:
        if isinstance(arm, str | Path) and is_model(arm):
            return arm, model, read_misfit(arm, model), None
        return arm, model, arm.misfit if isinstance(arm, IdentificationResult) else None, None
    if baseline:
        raise IdentificationError(
            'a baseline and recordings of a simulator were both given; give only one of them'
        )
    kinds = CATALOGUE.items()
    usual = [name for name, kind in kinds if kind.traits.usual or kind.traits.mjcf_attribute]
    found = identify(model.robot, recordings, effects=effects or ','.join(usual), rng=rng)
    return found.arm, found.arm, None, found
