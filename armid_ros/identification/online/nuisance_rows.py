# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Friction that the model lacks, as nuisance parameters.

Friction that a model lacks biases the identified parameters, and the bias varies with the motion.
A search for changes would mistake this for a change, or for a part of its size. The friction law
does not vary, so it is estimated too: viscous and Coulomb friction, if the model lacks them, and
friction in proportion to the load. A sum of humps at low velocities is added as a curve over
velocity.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE
from armid_ros.identification.online.recursive import WeightedSample
from armid_ros.identification.rows.causal import CausalMotion, TripleLag
from armid_ros.motion import FloatArray, Motion
import numpy as np


class Row(NamedTuple):
    """
    A filtered row, and the state from which its friction columns are computed.

    Attributes
    ----------
    t : float
        Time of the row [s].
    sample : WeightedSample
        Rows, torques and weights for the estimator.
    motion : CausalMotion
        Output of the motion filter.
    step : float
        Time since the row before [s].
    gain : float
        Divisor of the rows: gain of the filters for white noise [-].
    begins : bool
        Whether the row begins a new stretch.

    """

    t: float
    sample: WeightedSample
    motion: CausalMotion
    step: float
    gain: float
    begins: bool = False


class NuisanceRows:
    """
    Filtered regressor columns of friction that the model lacks.

    Parameters
    ----------
    arm : ArmModel
        The arm, whose own effects are left out.
    cutoff : float
        Cut-off frequency of the row filter [Hz].

    Attributes
    ----------
    parameters : tuple of ParameterName
        Nuisance parameters, by quantity and then by joint.

    """

    def __init__(self, arm: ArmModel, cutoff: float) -> None:
        known = {effect.name for effect in arm.effects}
        self._arm = arm
        self._filter = TripleLag(cutoff)
        self._effects = [
            kind.on(arm.robot).with_shape(shape) if shape else kind.on(arm.robot)
            for kind in CATALOGUE.values()
            for shape in kind.traits.nuisance
            if kind.name not in known
        ]
        self.parameters = tuple(
            replace(name, name=f'{name.name}_beside_{number}')
            for number, effect in enumerate(self._effects)
            for name in effect.parameters(arm.robot)
        )

    def columns(self, some: Sequence[Row]) -> FloatArray:
        """Return the columns of N successive rows, shape (N, n, K n)."""
        moved = [(row.motion.q, row.motion.dq, row.motion.ddq) for row in some]
        q, dq, ddq = (np.stack(part) for part in zip(*moved, strict=True))
        t = np.array([row.motion.t for row in some])
        motion = Motion(self._arm.robot.joints, t, q, dq, ddq)
        # friction per unit of each quantity; every quantity acts on its own joint only
        torques = np.empty((len(some), motion.n_joints, len(self._effects)))
        for k, effect in enumerate(self._effects):
            torques[:, :, k] = np.diagonal(effect.columns(motion, self._arm), axis1=1, axis2=2)
        columns = np.zeros((*torques.shape, motion.n_joints))
        own = np.einsum('sjkj->sjk', columns)
        for row, raw, place in zip(some, torques, own, strict=True):
            if row.begins:
                self._filter.reset()
            smooth = self._filter.update(row.step, raw.reshape(-1))[2]
            np.divide(smooth.reshape(raw.shape), row.gain, out=place)
        return columns.reshape(len(some), motion.n_joints, -1)
