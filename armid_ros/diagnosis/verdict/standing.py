# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What acts on a joint that stands still, or turns round.

Dry friction holds it with any torque up to its own, so that such rows tell nothing of a model, and
with no more than that. What is left beyond comes from a stop, a brake, or a contact.

"""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.motion import FloatArray
import numpy as np

#: Dry friction by which a joint at rest may be held: twice that of motion until it breaks away,
#: and once what a model has of it in a direction of its own choice.
_HELD = 3.0
#: Deviations of the unit of the gap that are noise.
_SURELY = 3.0
#: What lasts shorter may be chance [s].
_SHORTEST = 0.2


def standing(arm: ArmModel, evidence: Evidence, residual: Sequence[FloatArray]) -> FloatArray:
    """
    Return by how much what is left of rows that tell nothing is beyond friction, squared, (n,).

    Noise and misfit counted in. Zero where it is not, and where no dry friction is known.

    """
    friction = arm.action().dry_friction
    joints = arm.robot.n_joints
    if friction is None:
        return np.zeros(joints)
    squares, time = np.zeros((2, joints))
    for part, left, sigma in zip(evidence.data, residual, evidence.sigma, strict=True):
        held = _HELD * friction.largest(arm.load(part.at_rows))
        beyond = (np.abs(left) / (held + _SURELY * sigma)) ** 2
        more = ~part.informative & (held > 0.0) & (beyond > 1.0)
        period = float(part.t[1] - part.t[0])
        time += period * more.sum(axis=0)
        squares += period * np.sum(beyond, axis=0, where=more)
    return np.where(time > _SHORTEST, squares / np.maximum(time, 1e-300), 0.0)
