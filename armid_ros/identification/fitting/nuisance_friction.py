# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Friction that arms have and nobody asked for.

What a model lacks bends the parameters that are identified, and comes and goes with the motion: a
search for changes would take it for one, or the torques of a fast motion, which bent inertias
predict wrongly, for the size of another. It is the same in every motion though, so it is learned
beside them: viscous and Coulomb friction, if the model does not have them, friction in proportion
to the load, and a curve over velocity, which is a sum of humps at low velocities.

"""

from __future__ import annotations

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, Effect
from armid_ros.motion import FloatArray, Motion
import numpy as np


class NuisanceFriction:
    """
    Columns of friction that an arm model does not have.

    Parameters
    ----------
    arm : ArmModel
        What it has already, and the load of its joints.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Quantity by quantity, in each of them joint by joint.

    """

    def __init__(self, arm: ArmModel) -> None:
        self._arm = arm
        self._effects = _lacking(arm)
        self.parameters = tuple(
            replace(name, name=f'{name.name}_beside_{number}')
            for number, effect in enumerate(self._effects)
            for name in effect.parameters(arm.robot)
        )

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


def _lacking(arm: ArmModel) -> list[Effect]:
    """Return the friction that an arm may have, but for what is known of it."""
    known = {effect.name for effect in arm.effects}
    return [
        kind.on(arm.robot).with_shape(shape) if shape else kind.on(arm.robot)
        for kind in CATALOGUE.values()
        for shape in kind.traits.nuisance
        if kind.name not in known
    ]


def by_joint(torques: FloatArray) -> FloatArray:
    """Return torques that act on their own joint, (..., n, K), as rows, (..., n, K n)."""
    *samples, n, count = torques.shape
    rows = np.zeros((*samples, n, count, n))
    np.einsum('...jkj->...jk', rows)[...] = torques
    return rows.reshape(*samples, n, count * n)
