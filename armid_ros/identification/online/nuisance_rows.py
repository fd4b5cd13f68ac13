# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rows of nuisance parameters of the online identification, many samples at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.identification.fitting.nuisance_friction import by_joint, NuisanceFriction
from armid_ros.identification.rows.causal import CausalMotion, TripleLag
from armid_ros.motion import FloatArray, Motion
import numpy as np


class Seed(NamedTuple):
    """
    What the rows of one sample are made from.

    Attributes
    ----------
    motion : CausalMotion
        Behind the motion filter.
    step : float
        Time since the sample before [s].
    gain : float
        What the rows are divided by.

    """

    motion: CausalMotion
    step: float
    gain: float


class NuisanceRows:
    """
    Makes and filters the columns of friction that an arm model does not have.

    Parameters
    ----------
    arm : ArmModel
        What it has already.
    cutoff : float
        Of the row filter [Hz].

    Attributes
    ----------
    parameters : tuple of ParameterName
        Of the columns.

    """

    def __init__(self, arm: ArmModel, cutoff: float) -> None:
        self._joints = arm.robot.joints
        self._friction = NuisanceFriction(arm)
        self._filter = TripleLag(cutoff)
        self.parameters = self._friction.parameters

    def reset(self) -> None:
        """Begin a new stretch."""
        self._filter.reset()

    def rows(self, seeds: Sequence[Seed]) -> FloatArray:
        """Return the rows of N successive samples, shape (N, n, K n)."""
        moved = [(s.motion.q, s.motion.dq, s.motion.ddq) for s in seeds]
        q, dq, ddq = (np.stack(part) for part in zip(*moved, strict=True))
        motion = Motion(self._joints, np.array([s.motion.t for s in seeds]), q, dq, ddq)
        torques = self._friction.torques(motion)
        filtered = np.empty_like(torques)
        for seed, raw, place in zip(seeds, torques, filtered, strict=True):
            smooth = self._filter.update(seed.step, raw.reshape(-1))[2]
            np.divide(smooth.reshape(raw.shape), seed.gain, out=place)
        return by_joint(filtered)
