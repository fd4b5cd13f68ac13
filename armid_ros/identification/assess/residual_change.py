# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Whether a model leaves more of the torque than another one did: a change that no parameter has.

The mean squares of two residuals are held against each other (Fisher's F). What a model gets
wrong of an arm is slow, so a recording has few independent values of it, however many rows.

"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any

from armid_ros.identification.assess.grade_limits import FREEDOM
from armid_ros.identification.known_fit import KnownFit
import numpy as np
from scipy.stats import f

#: Share of its torque below which the residual of a joint is of filters, and not of an arm [%].
LEAST_ERROR = 0.1


@dataclass(frozen=True)
class ResidualChange:
    """
    What two models leave of one joint.

    Attributes
    ----------
    joint : str
        Which.
    before, after : float
        Root mean square residual, as the file has it [N m].
    before_error, after_error : float or None
        The same over the torque of the joint [%].
    ratio : float
        Of the second to the first, divided by how much more torque there was.
    p_value : float
        Probability that motions alone make them differ as much.
    changed : bool
        Whether they differ by more than chance.

    """

    joint: str
    before: float
    after: float
    before_error: float | None
    after_error: float | None
    ratio: float
    p_value: float
    changed: bool = False

    def document(self) -> dict[str, Any]:
        """Return it for programs to read."""
        return asdict(self) | {'ratio': self.ratio if isfinite(self.ratio) else None}


def residual_changes(
    before: KnownFit | None, after: KnownFit | None
) -> tuple[ResidualChange, ...]:
    """
    Hold against each other what two models leave of each joint.

    Empty where it is not known alike: the misfit of model.yaml and the residual of
    identification.json are of other rows.

    """
    if before is None or after is None or before.as_diagnosed != after.as_diagnosed:
        return ()
    freedoms = FREEDOM * after.recordings, FREEDOM * before.recordings
    found = []
    for joint in (one for one in before.rms if one in after.rms):
        ratio = _ratio(before, after, joint)
        with np.errstate(over='ignore'):
            square = np.square(ratio)
        p_value = 2.0 * min(float(f.sf(square, *freedoms)), float(f.cdf(square, *freedoms)))
        errors = before.errors.get(joint), after.errors.get(joint)
        left = before.rms[joint], after.rms[joint]
        found.append(ResidualChange(joint, *left, *errors, ratio, min(p_value, 1.0)))
    return tuple(found)


def _ratio(before: KnownFit, after: KnownFit, joint: str) -> float:
    """Return by how many times more is left than a model would leave of as much torque."""
    torques = before.torque(joint), after.torque(joint)
    first, second = (
        max(one.rms[joint], LEAST_ERROR / 100.0 * torque)
        for one, torque in zip((before, after), torques, strict=True)
    )
    if first == second:
        return 1.0
    ratio = second / first if first > 0.0 else float('inf')
    growth = torques[1] / torques[0] if min(torques) > 0.0 else 1.0
    if ratio > 1.0:
        return max(ratio / max(growth, 1.0), 1.0)
    return min(ratio / min(growth, 1.0), 1.0)
