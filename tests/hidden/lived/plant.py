# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The effort that an arm reports along a motion, exactly, with and without a cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.hidden.arrays import FloatArray, low_pass
from tests.hidden.lived.causes.base import Cause
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import Path
from tests.hidden.lived.wear import bristle, Wear


@dataclass(frozen=True)
class LivedArm:
    """
    An arm with its clutter.

    Attributes
    ----------
    chain : Chain
        Bodies as they are.
    wear : Wear
        Clutter.

    """

    chain: Chain
    wear: Wear

    def effort(self, path: Path, cause: Cause | None = None) -> FloatArray:
        """
        Return what perfect instruments report, shape (N, n) [N m].

        Parameters
        ----------
        path : Path
            Motion as the encoders see it.
        cause : Cause or None
            What has happened to the arm.

        """
        chain, wear, t = self.chain, self.wear, path.t
        extra: FloatArray | float = 0.0
        dry: FloatArray | float = 0.0
        if cause is not None:
            path = cause.truth(path)
            chain, wear = cause.bodies(chain), cause.wear(wear)
            extra, dry = cause.torque(path, chain), cause.dry(path.dq)
        rigid = chain.torque(path.q, path.dq, path.ddq)
        tau = rigid + extra + _friction(path, rigid, wear, dry)
        tau = tau + wear.rotor * path.ddq + wear.spring * (path.q - wear.rest)
        reported = low_pass(tau, wear.lag, float(t[1] - t[0])) * (1.0 + wear.gain) + wear.offset
        return reported if cause is None else cause.reading(t, reported)

    def contribution(self, path: Path, cause: Cause | None) -> FloatArray:
        """Return the effort with a cause less that without it along the same recorded motion."""
        return self.effort(path, cause) - self.effort(path)


def _friction(path: Path, load: FloatArray, wear: Wear, dry: FloatArray | float) -> FloatArray:
    """Return the torque of friction and of what repeats by the turn, shape (N, n) [N m]."""
    level = wear.coulomb + wear.load_share * np.abs(load) + dry
    slow = np.zeros_like(path.dq)
    there = wear.stribeck_speed > 0.0
    slow[:, there] = wear.stribeck[there] * np.exp(
        -((path.dq[:, there] / wear.stribeck_speed[there]) ** 2)
    )
    ripple = wear.ripple * np.sin(wear.order * path.q + wear.phase)
    direction = bristle(path.q, wear.presliding)
    return (level + slow) * direction + wear.viscous * path.dq + ripple
