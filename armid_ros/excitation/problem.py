# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a design is for: the parameters to see, the noise to see them through."""

from __future__ import annotations

from dataclasses import dataclass, field

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.criteria import CRITERIA, Information
from armid_ros.excitation.limits import Limits
from armid_ros.model import BaseParameters, group_columns, random_motion, regressor
from armid_ros.motion import FloatArray, Motion, read_only
import numpy as np

#: Which parameters a design is for.
TARGETS = {
    'all': 'all base parameters of the rigid body, and those of the effects',
    'gravity': 'masses and first moments, as an arm moving slowly shows them',
    'effects': 'those of the effects alone, the rigid body being known',
}


@dataclass(frozen=True)
class DesignSettings:
    """
    What to design.

    Attributes
    ----------
    period : float
        Period of the trajectory [s].
    harmonics : int
        Number of harmonics per joint.
    n_periods : int
        How often the period is run through.
    run_in : float
        Duration of the run-in and of the run-out [s].
    start : ndarray, shape (n,), or None
        Pose to start from and to end in [rad or m]; None: poses on the trajectory.
    speed : str or float
        'slow', 'medium', 'fast' or a share of the velocity and acceleration limits.
    limits : Limits or None
        Limits in place of those of the robot; ``speed`` does not apply to them.
    clearance : float
        Distance to keep between bodies that may touch [m].
    criterion : str
        'D', 'A', 'E' or 'condition'.
    target : str
        'all', 'gravity' or 'effects'.
    noise : ndarray, shape (n,), or None
        Standard deviation of the torque noise of each joint [N m or N]; None: 1 % of the torque
        limit, or of the largest such limit where a joint has none.
    rate : float
        Samples per second that the noise refers to [Hz], for the predicted deviations.
    samples : int
        Samples of one period at which the criterion is computed.
    starts : int
        Number of random trajectories the search sets out from.
    candidates : int
        Number of random feasible trajectories that each start is the best of.

    """

    period: float = 20.0
    harmonics: int = 5
    n_periods: int = 2
    run_in: float = 2.0
    start: FloatArray | None = None
    speed: str | float = 'fast'
    limits: Limits | None = None
    clearance: float = 0.01
    criterion: str = 'D'
    target: str = 'all'
    noise: FloatArray | None = None
    rate: float = 100.0
    samples: int = 100
    starts: int = 4
    candidates: int = 25

    def __post_init__(self) -> None:
        """Check names and numbers."""
        if self.criterion not in CRITERIA:
            raise TrajectoryError(
                f"no criterion '{self.criterion}'; there are {', '.join(CRITERIA)}"
            )
        if self.target not in TARGETS:
            raise TrajectoryError(f"no target '{self.target}'; there are {', '.join(TARGETS)}")
        for name in ('harmonics', 'n_periods', 'samples', 'starts', 'candidates'):
            if getattr(self, name) < 1:
                raise TrajectoryError(f'{name}: {getattr(self, name)}; at least 1 is needed')
        for name in ('period', 'run_in', 'rate'):
            if not 0.0 < getattr(self, name) < np.inf:
                raise TrajectoryError(f'{name}: {getattr(self, name)}; it has to be positive')
        if self.samples < 4 * self.harmonics:
            raise TrajectoryError(
                f'{self.samples} samples of a period cannot show {self.harmonics} harmonics; '
                f'take {4 * self.harmonics} or more'
            )


@dataclass(frozen=True)
class Problem:
    """
    A design problem with everything that does not change while it is being solved.

    Attributes
    ----------
    arm : ArmModel
        Prior model: rigid body, and effects whose parameters are to be seen.
    settings : DesignSettings
        What to design.
    limits : Limits
        Limits in force.
    base : BaseParameters
        The parameters to see.
    noise : ndarray, shape (n,)
        Standard deviation of the torque noise [N m or N].
    scale : ndarray, shape (r,)
        See `Information`.

    """

    arm: ArmModel
    settings: DesignSettings
    limits: Limits
    base: BaseParameters
    noise: FloatArray = field(repr=False)
    scale: FloatArray = field(repr=False)

    @classmethod
    def of(cls, arm: ArmModel, settings: DesignSettings, rng: np.random.Generator) -> Problem:
        """Derive limits, base parameters and noise; TrajectoryError where they do not exist."""
        limits = settings.limits or Limits.of(arm.robot, speed=settings.speed)
        noise = _noise(arm, settings)
        base = _base_parameters(arm, settings.target, rng)
        columns = target_columns(arm, settings.target, random_motion(arm.robot, 200, rng))
        weighted = columns[:, :, base.independent] / noise[:, np.newaxis]
        scale = 1.0 / np.sqrt(np.mean(weighted**2, axis=(0, 1)))
        return cls(arm, settings, limits, base, read_only(noise), read_only(scale))

    def weighted_regressor(self, motion: Motion) -> FloatArray:
        """Return W, shape (N n, r), of a motion."""
        columns = target_columns(self.arm, self.settings.target, motion)
        return (columns[:, :, self.base.independent] / self.noise[:, np.newaxis]).reshape(
            -1, self.base.rank
        )

    def information(self, motion: Motion, n_recorded: float | None = None) -> Information:
        """
        Return what a motion tells.

        Parameters
        ----------
        motion : Motion
            Samples that stand for the whole run.
        n_recorded : float, optional
            Number of samples that will be recorded; by default those of the motion.

        """
        w = self.weighted_regressor(motion)
        weight = 1.0 if n_recorded is None else n_recorded / len(motion)
        return Information(self.base.parameters, weight * (w.T @ w), self.scale)


def _noise(arm: ArmModel, settings: DesignSettings) -> FloatArray:
    n = arm.robot.n_joints
    if settings.noise is not None:
        noise = np.asarray(settings.noise, dtype=float)
        if noise.shape != (n,) or not np.all(np.isfinite(noise) & (noise > 0.0)):
            raise TrajectoryError(f'noise: {n} positive numbers are needed, got {noise}')
        return noise
    limit = arm.robot.torque_limit
    finite = np.isfinite(limit)
    fallback = limit[finite].max() if finite.any() else 100.0
    return np.asarray(0.01 * np.where(finite, limit, fallback))


def _base_parameters(arm: ArmModel, target: str, rng: np.random.Generator) -> BaseParameters:
    columns = target_columns(arm, target, random_motion(arm.robot, 40 * arm.robot.n_joints, rng))
    if not columns.any():
        raise TrajectoryError(f"target '{target}': {arm.robot.name} has no such parameter to see")
    return group_columns(columns.reshape(-1, columns.shape[-1]), arm.parameters)


def target_columns(arm: ArmModel, target: str, motion: Motion) -> FloatArray:
    """
    Return the sensitivities to the parameters of a target.

    Returns
    -------
    ndarray, shape (N, n, P)
        Columns of ``arm.parameters``; zero where a parameter is not in the target.

    """
    effects = arm.effect_columns(motion)
    if target == 'effects':
        rigid = np.zeros((*motion.q.shape, len(arm.robot.rigid_parameters)))
    elif target == 'gravity':
        rest = np.zeros_like(motion.q)
        rigid = regressor(arm.robot, Motion(motion.joints, motion.t, motion.q, rest, rest))
    else:
        rigid = regressor(arm.robot, motion)
    return np.concatenate([rigid, effects], axis=2)
