# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Friction that arms have and that is not identified, as nuisance parameters.

What a model lacks bends the parameters that are identified, and comes and goes with the motion: a
search for changes would take it for one, or the torques of a fast motion, which bent inertias
predict wrongly, for the size of another. It is the same in every motion though, so it is learned
together with them: viscous and Coulomb friction, if the model does not have them, friction in
proportion to the load, and a curve over velocity, which is a sum of humps at low velocities.

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
        Its time [s].
    sample : WeightedSample
        What the estimator takes in.
    motion : CausalMotion
        Behind the motion filter.
    step : float
        Time since the row before [s].
    gain : float
        What the rows are divided by.
    begins : bool
        Whether it does not continue the row before.

    """

    t: float
    sample: WeightedSample
    motion: CausalMotion
    step: float
    gain: float
    begins: bool = False


class NuisanceRows:
    """
    Computes and filters the columns of friction that the model lacks.

    Parameters
    ----------
    arm : ArmModel
        What it has already, and the load of its joints.
    cutoff : float
        Of the row filter [Hz].

    Attributes
    ----------
    parameters : tuple of ParameterName
        Quantity by quantity, in each of them joint by joint.

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
        # the friction of a unit of each quantity, of which each acts on its own joint
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
