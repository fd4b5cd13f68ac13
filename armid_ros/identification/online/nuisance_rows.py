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

    def reset(self) -> None:
        """Begin a new stretch."""
        self._filter.reset()

    def torques(self, motion: Motion) -> FloatArray:
        """
        Return the friction of a unit of each quantity, joint by joint.

        Parameters
        ----------
        motion : Motion
            N samples.

        Returns
        -------
        ndarray, shape (N, n, K)
            Torques; each acts on its own joint.

        """
        columns = [effect.columns(motion, self._arm) for effect in self._effects]
        torques = np.empty((len(motion), motion.n_joints, len(columns)))
        for k, column in enumerate(columns):
            torques[:, :, k] = np.diagonal(column, axis1=1, axis2=2)
        return torques

    def rows(self, seeds: Sequence[Seed]) -> FloatArray:
        """Return the rows of N successive samples, shape (N, n, K n)."""
        moved = [(s.motion.q, s.motion.dq, s.motion.ddq) for s in seeds]
        q, dq, ddq = (np.stack(part) for part in zip(*moved, strict=True))
        motion = Motion(self._arm.robot.joints, np.array([s.motion.t for s in seeds]), q, dq, ddq)
        torques = self.torques(motion)
        filtered = np.empty_like(torques)
        for seed, raw, place in zip(seeds, torques, filtered, strict=True):
            smooth = self._filter.update(seed.step, raw.reshape(-1))[2]
            np.divide(smooth.reshape(raw.shape), seed.gain, out=place)
        return by_joint(filtered)


def by_joint(torques: FloatArray) -> FloatArray:
    """Return torques that act on their own joint, (..., n, K), as rows, (..., n, K n)."""
    *samples, n, count = torques.shape
    rows = np.zeros((*samples, n, count, n))
    np.einsum('...jkj->...jk', rows)[...] = torques
    return rows.reshape(*samples, n, count * n)
