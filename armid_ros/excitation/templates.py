# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Templates of motions: of all or single joints, slow or fast, with or without a payload."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.feasibility import trajectory_faults
from armid_ros.excitation.fourier import FourierTrajectory
from armid_ros.excitation.geometry.clearance import ClearanceModel
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.random_trajectory import random_feasible
import numpy as np

#: Number of draws of a motion of single joints; each draw has another pose of the other joints.
_DRAWS = 6
#: Clearance between links [m], as excitations keep it.
CLEARANCE = 0.01


@dataclass(frozen=True)
class Template:
    """
    Template of a motion.

    Attributes
    ----------
    name : str
        Description of the motion.
    speed : float
        Share of the velocity and acceleration limits.
    period : float
        Period [s].
    harmonics : int
        Number of harmonics.
    joints : tuple of str
        The joints that move; all if empty.
    amplitude : float
        Largest amplitude [rad or m].
    loaded : bool
        Whether the motion is run twice, without and with a known payload.

    """

    name: str
    speed: float
    period: float
    harmonics: int
    joints: tuple[str, ...] = ()
    amplitude: float = np.inf
    loaded: bool = False

    def draw(
        self, arm: ArmModel, clearance: ClearanceModel, rng: np.random.Generator
    ) -> FourierTrajectory:
        """
        Draw a motion that keeps all limits and the clearance.

        Raises
        ------
        TrajectoryError
            If no motion is feasible; the message names the obstruction.

        """
        limits = Limits.of(arm.robot, speed=self.speed)
        faults = ''
        for _ in range(_DRAWS):
            whole = random_feasible(
                arm,
                limits,
                self.period,
                self.harmonics,
                rng,
                collision=clearance,
                margin=CLEARANCE,
            )
            size = np.ptp(whole.one_period(40 * self.harmonics).q, axis=0) / 2.0
            moving = [not self.joints or joint in self.joints for joint in whole.joints]
            share = np.minimum(1.0, self.amplitude / np.maximum(size, 1e-9))
            trajectory = whole.scaled(np.where(moving, share, 0.0))
            found = trajectory_faults(arm, limits, trajectory, clearance, CLEARANCE)
            if not found:
                return trajectory
            faults = str(found)
        raise TrajectoryError(f'{self.name}: {faults}')


#: Motions of all joints, slow to fast, and as fast as the accelerations allow.
_WHOLE = (
    Template('slow motion of all joints', 0.1, 12.0, 3),
    Template('motion of all joints at medium speed', 0.4, 10.0, 5),
    Template('fast motion of all joints', 0.9, 8.0, 6),
    Template('shaking of all joints', 0.9, 4.0, 20),
)


def templates(joints: Sequence[str]) -> tuple[Template, ...]:
    """Return motions that identify effects on some joints; without joints, on the arm."""
    chosen = list(_WHOLE)
    if joints:
        names, alone = ', '.join(joints), tuple(joints)
        chosen += [
            Template(f'slow motion of {names} alone', 0.1, 12.0, 3, alone),
            Template(f'fast motion of {names} alone', 0.9, 8.0, 6, alone),
            Template(f'reversals of {names} by less than 0.02', 0.4, 4.0, 2, alone, 0.01),
        ]
    loaded = [
        replace(t, name=f'{t.name}, without and with a known payload', loaded=True)
        for t in _WHOLE[:3]
    ]
    return (*chosen, *loaded)
