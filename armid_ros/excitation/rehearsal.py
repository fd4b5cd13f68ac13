# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A slow run before the real one: whether the arm follows, and takes the torques foreseen."""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.arm import ArmModel
from armid_ros.excitation.supervision import Path
from armid_ros.motion import FloatArray
import numpy as np

#: Samples of the path at which the torque is foreseen.
_SAMPLES = 4000
#: A torque is as foreseen within this factor of its largest foreseen value: a description knows no
#: friction, and friction is most of what a slow arm takes.
_SURPRISING = 3.0


@dataclass(frozen=True)
class RehearsalReport:
    """
    How a rehearsal went.

    Attributes
    ----------
    joints : tuple of str
        n joint names.
    tracking : ndarray, shape (n,)
        Largest distance from where the joint should have been [rad or m].
    torque, foreseen : ndarray, shape (n,)
        Largest torque that was measured, and that the description foresees [N m or N]; measured
        NaN where none was.
    limit : ndarray, shape (n,)
        What the drives have [N m or N].
    samples : int
        Joint states that it rests on.

    """

    joints: tuple[str, ...]
    tracking: FloatArray
    torque: FloatArray
    foreseen: FloatArray
    limit: FloatArray
    samples: int

    @property
    def surprises(self) -> tuple[str, ...]:
        """Return what was not as foreseen, a sentence a joint."""
        if not self.samples:
            return ('no joint state came during the rehearsal',)
        said = []
        for joint, torque, foreseen, limit in zip(
            self.joints, self.torque, self.foreseen, self.limit, strict=True
        ):
            room = max(foreseen, 0.05 * limit if np.isfinite(limit) else 0.0)
            if torque > _SURPRISING * room > 0.0:
                said.append(f'{joint} took {torque:.3g}, and {foreseen:.3g} N m were foreseen')
        return tuple(said)

    def __str__(self) -> str:
        """Return the report in a sentence or two."""
        if not self.samples:
            return self.surprises[0]
        worst = int(np.argmax(self.tracking))
        text = f'followed within {self.tracking[worst]:.3g} ({self.joints[worst]})'
        if np.isfinite(self.torque).any():
            share = self.torque / np.where(self.limit > 0.0, self.limit, np.inf)
            most = int(np.nanargmax(share))
            text += f'; most torque {self.torque[most]:.3g} N m ({self.joints[most]}), '
            text += f'{self.foreseen[most]:.3g} foreseen'
        return '; '.join((text, *self.surprises))


class Rehearsal:
    """
    What came of an arm while it rehearsed.

    Parameters
    ----------
    path : Path
        What it should follow.
    arm : ArmModel
        Foresees the torque.

    """

    def __init__(self, path: Path, arm: ArmModel) -> None:
        self._path, self._arm = path, arm
        self._tracking, self._torque = np.full((2, arm.robot.n_joints), np.nan)
        self._count, self._until = 0, 0.0

    def add(self, phase: float, q: FloatArray, tau: FloatArray) -> None:
        """
        Take a joint state.

        Parameters
        ----------
        phase : float
            Time since the start of the path [s].
        q, tau : ndarray, shape (n,)
            Measured position and torque; NaN where there is none.

        """
        distance = np.abs(q - self._path.at([phase]).q[0])
        self._tracking = np.fmax(self._tracking, distance)
        self._torque = np.fmax(self._torque, np.abs(tau))
        self._count, self._until = self._count + 1, max(self._until, phase)

    def report(self) -> RehearsalReport:
        """Return how it went so far."""
        robot = self._arm.robot
        wanted = self._path.at(np.linspace(0.0, self._until, _SAMPLES))
        foreseen = np.abs(self._arm.joint_torque(wanted)).max(axis=0)
        limit = robot.torque_limit
        return RehearsalReport(
            robot.joints, self._tracking, self._torque, foreseen, limit, self._count
        )
