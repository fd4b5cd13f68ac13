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
from armid_ros.diagnosis.data.baseline import Baseline
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.verdict.gap import Excess
from armid_ros.diagnosis.verdict.where import Where
from armid_ros.motion import FloatArray
import numpy as np
from scipy.ndimage import uniform_filter1d

#: Dry friction by which a joint at rest may be held: twice that of motion until it breaks away,
#: and once what a model has of it in a direction of its own choice.
_HELD = 3.0
#: Deviations of the unit of the gap that are noise.
_SURELY = 3.0
#: What lasts shorter may be chance, or what a filter of positions makes of a jerk [s].
_SHORTEST = 0.2
#: Factor on what a baseline shows of it: a brake holds an arm on every day.
_AS_BEFORE = 1.5
#: Where it is, for a table, and the end of a sentence.
_WHERE = 'at rest or turning round, and more than friction: a stop, a brake or a contact'
_BESIDE = (
    'with friction, where it stands still or turns round: a stop, a brake or a contact does that'
)


def held(arm: ArmModel, evidence: Evidence, before: Baseline | None, given: ArmModel) -> Excess:
    """
    Return what acts on joints that stand still or turn round, beyond friction.

    Parameters
    ----------
    arm : ArmModel
        The patched arm.
    evidence : Evidence
        The data.
    before : Baseline or None
        Recordings in which nothing was wrong, of the arm as given: what held it then does still.
    given : ArmModel
        That arm.

    """
    residual = [part.residual(arm) for part in evidence.data]
    excess = standing(arm, evidence, residual)
    if before is not None:
        unit = (before.misfit,) * len(before.data)
        then = standing(given, Evidence(before.data, unit, unit), before.residual)
        excess = excess / np.maximum(_AS_BEFORE * then, 1.0)
    return Excess(excess, _BESIDE)


def places_held(arm: ArmModel, left: Sequence[Excess]) -> tuple[Where, ...]:
    """Say which joints are held, the worst first."""
    excess = np.max([np.zeros(arm.robot.n_joints), *(one.ratio for one in left)], axis=0)
    beyond = np.where(excess > 1.0, excess, 0.0)
    order = np.argsort(-beyond)[: np.count_nonzero(beyond)]
    whole = float(beyond.sum())
    return tuple(
        Where(arm.robot.joints[j], float(beyond[j]) / whole, _WHERE, (), arm.robot.torque_units[j])
        for j in order.tolist()
    )


def standing(arm: ArmModel, evidence: Evidence, residual: Sequence[FloatArray]) -> FloatArray:
    """
    Return by how much what is left of rows that tell nothing is beyond friction, squared, (n,).

    Noise and misfit counted in; a joint that turns round accelerates most, and what a model gets
    wrong grows with the torque that it predicts. What a filter of positions makes of a jerk is as
    much below as above in the mean of its own time. Zero where it is not, and where no dry
    friction is known.

    """
    friction = arm.action().dry_friction
    joints = arm.robot.n_joints
    if friction is None:
        return np.zeros(joints)
    squares, time = np.zeros((2, joints))
    usual = np.maximum(evidence.torque_rms, 1e-300)
    for part, left, sigma in zip(evidence.data, residual, evidence.sigma, strict=True):
        held = _HELD * friction.largest(arm.load(part.at_rows))
        louder = np.maximum(np.abs(part.torque - left) / usual, 1.0)
        period = float(part.t[1] - part.t[0])
        shortest = max(_SHORTEST, 1.0 / part.used.cutoff_hz)
        lasting = uniform_filter1d(left, max(round(shortest / period), 1), axis=0)
        beyond = (lasting / (held + _SURELY * sigma * louder)) ** 2
        more = ~part.informative & (held > 0.0) & (beyond > 1.0)
        time += period * more.sum(axis=0)
        squares += period * np.sum(beyond, axis=0, where=more)
    return np.where(time > _SHORTEST, squares / np.maximum(time, 1e-300), 0.0)
