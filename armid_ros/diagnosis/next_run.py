# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The next run: of several motions within the limits, the one that separates two names best.

T-optimality (Atkinson and Fedorov 1975): with the named effect in the arm, a motion is worth what
the rival, with everything that is free fitted to it, cannot explain of its torque, over noise.

"""

from __future__ import annotations

from dataclasses import dataclass

from armid_ros.diagnosis.diagnose import Diagnosis
from armid_ros.effects import Effect
from armid_ros.errors import TrajectoryError
from armid_ros.excitation import Excitation, Limits, random_feasible
from armid_ros.motion import Motion
import numpy as np

#: Share of the speed limits, period [s] and harmonics of the motions that are tried.
_MOTIONS = ((0.1, 12.0, 3), (0.3, 10.0, 5), (0.6, 8.0, 6), (0.9, 8.0, 8))
_DRAWS = 2
_RATE = 50.0


@dataclass(frozen=True)
class NextRun:
    """
    A motion to run next.

    Attributes
    ----------
    excitation : Excitation
        Within the limits of the robot; two equal periods.
    name, rival : str
        What it separates.
    worth : float
        Sum of squares over noise that the rival would leave, in one period.

    """

    excitation: Excitation
    name: str
    rival: str
    worth: float


def next_run(diagnosis: Diagnosis, rng: np.random.Generator) -> NextRun | None:
    """Choose a motion for the first name that has rivals; None if there is none."""
    explanation = diagnosis.explanation
    if explanation is None:
        return None
    doubtful = [k for k, step in enumerate(explanation.steps) if step.rivals]
    if not doubtful:
        return None
    named = explanation.fitted.named[doubtful[0]].effect
    rival = explanation.steps[doubtful[0]].rivals[0].score.group.effect
    best: NextRun | None = None
    for speed, period, harmonics in _MOTIONS * _DRAWS:
        limits = Limits.of(diagnosis.arm.robot, speed=speed)
        try:
            trajectory = random_feasible(diagnosis.arm, limits, period, harmonics, rng)
        except TrajectoryError:
            continue
        motion = trajectory.one_period(int(period * _RATE))
        worth = _worth(diagnosis, motion, named, rival)
        if best is None or worth > best.worth:
            best = NextRun(Excitation(trajectory), named.name, rival.name, worth)
    return best


def _worth(diagnosis: Diagnosis, motion: Motion, named: Effect, rival: Effect) -> float:
    arm = diagnosis.arm
    noise = np.mean([floor.sigma for floor in diagnosis.floors], axis=0)[:, np.newaxis]
    target = arm.columns_of(named, motion) @ arm.values_of(named)
    free = [arm.columns_of(rival, motion)]
    if diagnosis.refitted:
        free.append(arm.rigid_columns(motion))
        free += [arm.columns_of(e, motion) for e in arm.effects if e != named]
    columns = np.concatenate(free, axis=2) / noise
    flat = columns.reshape(-1, columns.shape[2])
    scale = np.maximum(np.linalg.norm(flat, axis=0), 1e-12)
    wanted = (target / noise[:, 0]).ravel()
    left = wanted - flat / scale @ np.linalg.lstsq(flat / scale, wanted, rcond=1e-8)[0]
    return float(left @ left)
