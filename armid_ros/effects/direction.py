# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The direction of motion, on which dry friction depends.

The sign of a velocity has no useful gradient. Therefore the search for a trajectory evaluates
columns along a `BlurredMotion`, whose direction is tanh(dq / width).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from armid_ros.motion import FloatArray, Motion, read_only
import numpy as np


@dataclass(frozen=True)
class BlurredMotion(Motion):
    """
    A motion whose direction changes smoothly where it reverses.

    Attributes
    ----------
    width : ndarray, shape (n,)
        Velocity below which the direction is blurred [rad/s or m/s].

    """

    width: FloatArray = field(kw_only=True)

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        super().__post_init__()
        object.__setattr__(self, 'width', read_only(self.width))


def direction(motion: Motion, joints: Sequence[int] | None = None) -> FloatArray:
    """
    Return the sign of the velocity of each joint, or of a shaft.

    Parameters
    ----------
    motion : Motion
        N samples of n joints.
    joints : sequence of int, optional
        Joints whose velocities add up to the velocity of a shaft.

    Returns
    -------
    ndarray, shape (N, n), or (N,) of a shaft
        -1, 0 or 1 [-]; in between for a `BlurredMotion`.

    """
    velocity = motion.dq if joints is None else motion.dq[:, list(joints)].sum(axis=1)
    if not isinstance(motion, BlurredMotion):
        return np.asarray(np.sign(velocity))
    width = motion.width if joints is None else motion.width[list(joints)].min()
    return np.asarray(np.tanh(velocity / width))
