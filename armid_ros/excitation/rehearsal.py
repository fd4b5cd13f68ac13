# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A slow run before the real run: check of tracking errors and torques."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.excitation.supervision import Path
from armid_ros.motion import FloatArray
import numpy as np

#: Largest accepted ratio of a measured torque to the largest predicted torque. The ratio is large
#: because a description has no friction, and friction dominates the torque of a slow arm.
_SURPRISING = 3.0


class Rehearsal:
    """
    Results of a rehearsal.

    Parameters
    ----------
    path : Path
        The path to follow.
    arm : ArmModel
        Model for the torque prediction.

    Attributes
    ----------
    tracking : ndarray, shape (n,)
        Largest tracking error of each joint [rad or m].
    torque : ndarray, shape (n,)
        Largest measured torque [N m or N]; NaN if none was measured.

    """

    def __init__(self, path: Path, arm: ArmModel) -> None:
        self._path, self._arm = path, arm
        self.tracking, self.torque = np.full((2, arm.robot.n_joints), np.nan)
        self._count, self._until = 0, 0.0

    def add(self, phase: float, q: FloatArray, tau: FloatArray) -> None:
        """
        Add a joint state.

        Parameters
        ----------
        phase : float
            Time since the start of the path [s].
        q, tau : ndarray, shape (n,)
            Measured position and torque; NaN if not measured.

        """
        distance = np.abs(q - self._path.at([phase]).q[0])
        self.tracking = np.fmax(self.tracking, distance)
        self.torque = np.fmax(self.torque, np.abs(tau))
        self._count, self._until = self._count + 1, max(self._until, phase)

    def foreseen(self) -> FloatArray:
        """Return the largest predicted torque so far, shape (n,)."""
        wanted = self._path.at(np.linspace(0.0, self._until, 4000))
        return np.asarray(np.abs(self._arm.joint_torque(wanted)).max(axis=0))

    def report(self) -> tuple[str, tuple[str, ...]]:
        """Return a summary so far, and a sentence on each joint with an unexpected torque."""
        if not self._count:
            said = 'no joint state was received during the rehearsal'
            return said, (said,)
        robot, foreseen = self._arm.robot, self.foreseen()
        surprises: list[str] = []
        for j, joint in enumerate(robot.joints):
            limit = robot.torque_limit[j]
            room = max(foreseen[j], 0.05 * limit if np.isfinite(limit) else 0.0)
            if self.torque[j] > _SURPRISING * room > 0.0:
                took = f'{joint} took {self.torque[j]:.3g}'
                surprises.append(f'{took}, and {foreseen[j]:.3g} N m were foreseen')
        worst = int(np.argmax(self.tracking))
        text = f'followed within {self.tracking[worst]:.3g} ({robot.joints[worst]})'
        if np.isfinite(self.torque).any():
            limits = np.where(robot.torque_limit > 0.0, robot.torque_limit, np.inf)
            most = int(np.nanargmax(self.torque / limits))
            text += f'; most torque {self.torque[most]:.3g} N m ({robot.joints[most]}), '
            text += f'{foreseen[most]:.3g} foreseen'
        return '; '.join((text, *surprises)), tuple(surprises)
