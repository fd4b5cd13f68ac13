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

from armid_ros.arm import ArmModel
from armid_ros.estimate import ParameterName
from armid_ros.motion import FloatArray
import numpy as np
import pinocchio as pin

#: Velocities of the humps [rad/s or m/s].
_HUMPS = (0.03, 0.1, 0.3)


class FrictionBeside:
    """
    Columns of friction that an arm model does not have.

    Parameters
    ----------
    arm : ArmModel
        Its robot says what load the joints have.

    Attributes
    ----------
    parameters : tuple of ParameterName
        Quantity by quantity, in each of them joint by joint.

    """

    def __init__(self, arm: ArmModel) -> None:
        robot = arm.robot
        self._model, self._data = robot.model, robot.model.createData()
        known = {effect.name for effect in arm.effects}
        self._viscous = 'viscous_friction' not in known
        self._coulomb = 'coulomb_friction' not in known
        self._humps = np.array([] if 'stribeck_friction' in known else _HUMPS)
        self._load = 'load_dependent_friction' not in known
        self.parameters = tuple(
            ParameterName(f'{name}_beside', joint, unit)
            for name, unit in self._quantities()
            for joint in robot.joints
        )

    def _quantities(self) -> list[tuple[str, str]]:
        return [
            *[('viscous_coefficient', 'N m s/rad')] * self._viscous,
            *[('coulomb_torque', 'N m')] * self._coulomb,
            *[(f'hump_{velocity:g}', 'N m') for velocity in self._humps],
            *[('load_coefficient', '')] * self._load,
        ]

    def torques(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """
        Return the friction of a unit of each quantity, joint by joint, at one sample.

        Parameters
        ----------
        q, dq, ddq : ndarray, shape (n,)
            Motion.

        Returns
        -------
        ndarray, shape (n, K)
            Torques; each acts on its own joint.

        """
        sign = np.sign(dq)
        parts = [dq] * self._viscous + [sign] * self._coulomb
        parts += list(np.exp(-((dq / self._humps[:, np.newaxis]) ** 2)) * sign)
        if self._load:
            parts.append(np.abs(pin.rnea(self._model, self._data, q, dq, ddq)) * sign)
        return np.array(parts).reshape(-1, len(dq)).T


def by_joint(torques: FloatArray) -> FloatArray:
    """Return torques that act on their own joint, (n, K), as rows of a regressor, (n, K n)."""
    n, count = torques.shape
    rows = np.zeros((n, count, n))
    rows[np.arange(n), :, np.arange(n)] = torques
    return rows.reshape(n, count * n)
