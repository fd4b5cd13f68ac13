# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A design problem: parameters to identify, noise and limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from armid_ros.arm import ArmModel
from armid_ros.effects import Effect
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory, MARGIN
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.search.criteria import Criterion, Information
from armid_ros.excitation.settings import DesignSettings
from armid_ros.model import BaseParameters, group_columns, levelled, random_motion
from armid_ros.motion import FloatArray, Motion, read_only
import numpy as np
import numpy.typing as npt

#: Assumed standard deviation of unknown torque noise, as a share of the torque limit.
NOISE_SHARE = 0.01

#: Number of samples for the information, per sample of the search.
_EXACT = 6


@dataclass(frozen=True)
class DesignProblem:
    """
    A design problem, with all quantities that stay constant during the search.

    Attributes
    ----------
    arm : ArmModel
        Prior model: rigid body, and all effects that are identified.
    settings : DesignSettings
        Settings of the design.
    limits : Limits
        Limits in force.
    base : BaseParameters
        The parameters to identify.
    noise : ndarray, shape (n,)
        Standard deviation of the torque noise [N m or N].
    scale : ndarray, shape (r,)
        See `Information`.
    criterion : Criterion
        The cost.

    """

    arm: ArmModel
    settings: DesignSettings
    limits: Limits
    base: BaseParameters
    noise: FloatArray = field(repr=False)
    scale: FloatArray = field(repr=False)
    criterion: Criterion = field(repr=False)

    @classmethod
    def of(
        cls,
        arm: ArmModel,
        settings: DesignSettings,
        rng: np.random.Generator,
        rival: ArmModel | None = None,
    ) -> DesignProblem:
        """
        Derive limits, noise, base parameters and criterion.

        Raises
        ------
        TrajectoryError
            If the arm has no such parameter, or no motion can distinguish the arm from the rival.

        """
        limits = Limits.of(arm.robot, speed=settings.speed, acceleration=settings.acceleration)
        noise = torque_noise(arm, settings)
        if (settings.criterion == 'T') != (rival is not None):
            raise TrajectoryError(
                "criterion 'T' compares two models: it needs a rival, and a rival needs it"
            )
        whole = arm if rival is None else _joined(arm, rival)
        motion = random_motion(arm.robot, rng)
        columns = target_columns(whole, settings.target, motion)
        if not columns.any():
            raise TrajectoryError(
                f"target '{settings.target}': {arm.robot.name} has no such parameter to see"
            )
        level = replace(whole, robot=levelled(whole.robot))
        flat = target_columns(level, settings.target, motion).reshape(-1, columns.shape[-1])
        base = group_columns(flat, whole.parameters)
        columns = (columns / noise[:, np.newaxis]).reshape(flat.shape)[:, base.independent]
        scale = 1.0 / np.sqrt(np.sum(columns**2, axis=0) / len(motion))
        wanted, values = np.ones(base.rank, dtype=bool), base.values(whole.theta)
        if rival is not None:
            lacking = np.arange(len(whole.parameters)) >= len(rival.parameters)
            wanted, values = lacking[base.independent], base.values(lacking * whole.theta)
        elif settings.focus:
            wanted = _in_focus(whole, settings.focus)[base.independent]
        criterion = Criterion(settings.criterion, scale, wanted, values, settings.balance)
        problem = cls(whole, settings, limits, base, read_only(noise), read_only(scale), criterion)
        problem._require_visible(columns.T @ columns)
        return problem

    def _require_visible(self, matrix: FloatArray) -> None:
        """Raise a TrajectoryError if random motions carry no information on the target."""
        criterion = self.criterion
        if criterion.name != 'T':
            if not criterion.wanted.any():
                raise TrajectoryError(
                    f'focus: no motion distinguishes {", ".join(self.settings.focus)} from the '
                    "rigid body; take target 'effects', where the rigid body counts as known"
                )
        elif not np.isfinite(criterion.cost(matrix)):
            names = ', '.join(effect.name for effect in self.arm.effects) or 'nothing'
            raise TrajectoryError(
                f'no motion can tell the two models apart, which have {names} between them: the '
                'rival can make the same torques; give what it lacks another size'
            )

    def columns(self, motion: Motion) -> FloatArray:
        """Return the weighted columns of all parameters, shape (N n, P)."""
        columns = target_columns(self.arm, self.settings.target, motion)
        return (columns / self.noise[:, np.newaxis]).reshape(-1, columns.shape[-1])

    def recorded(self, trajectory: FourierTrajectory, n_periods: int) -> Information:
        """Return the information of a recording of some periods on the base parameters."""
        count, margin = _EXACT * self.settings.samples, MARGIN * trajectory.n_joints
        columns = self.columns(trajectory.with_margins(count))[margin:-margin]
        weight = self.settings.rate * trajectory.period * n_periods / count
        return self._information(columns, weight)

    def information(self, motion: Motion, n_recorded: float | None = None) -> Information:
        """
        Return the information of a motion on the base parameters.

        Parameters
        ----------
        motion : Motion
            Samples that represent the whole run, or a recorded motion.
        n_recorded : float, optional
            Number of samples that will be recorded; by default those of the motion.

        """
        weight = 1.0 if n_recorded is None else n_recorded / len(motion)
        return self._information(self.columns(motion), weight)

    def _information(self, columns: FloatArray, weight: float) -> Information:
        w = columns[:, self.base.independent]
        return Information(self.base.parameters, weight * (w.T @ w), self.scale)


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
    else:
        still = replace(arm, quasi_static=True) if target == 'gravity' else arm
        rigid = still.rigid_columns(motion)
    return np.concatenate([rigid, effects], axis=2)


def torque_noise(arm: ArmModel, settings: DesignSettings) -> FloatArray:
    """
    Return the standard deviation of the torque noise of each joint, shape (n,) [N m or N].

    Raises
    ------
    TrajectoryError
        If the settings have other than one positive number a joint.

    """
    n = arm.robot.n_joints
    if settings.noise is not None:
        noise = np.asarray(settings.noise, dtype=float)
        if noise.shape != (n,) or not np.all(np.isfinite(noise) & (noise > 0.0)):
            raise TrajectoryError(f'noise: {n} positive numbers are needed, got {noise}')
        return noise
    limit = arm.robot.torque_limit
    finite = np.isfinite(limit)
    fallback = limit[finite].max() if finite.any() else 100.0
    return np.asarray(NOISE_SHARE * np.where(finite, limit, fallback))


def _joined(arm: ArmModel, rival: ArmModel) -> ArmModel:
    """Return the effects of the rival, followed by the effects that only the arm has."""
    known = {(effect.name, effect.joints) for effect in rival.effects}
    joined = replace(rival, robot=arm.robot)
    for effect, values in zip(arm.effects, arm.values, strict=True):
        if (effect.name, effect.joints) not in known:
            joined = joined.with_effect(effect, values)
    return joined


def _in_focus(arm: ArmModel, focus: tuple[str, ...]) -> npt.NDArray[np.bool_]:
    """Mark the parameters of the effects in focus."""
    names = [effect.name for effect in arm.effects]
    unknown = [name for name in focus if name not in names]
    if unknown:
        raise TrajectoryError(
            f"focus: the arm has no effect '{unknown[0]}'; it has {', '.join(names) or 'none'}"
        )
    return marked(arm, lambda effect: effect.name in focus)


def marked(arm: ArmModel, which: Callable[[Effect], bool]) -> npt.NDArray[np.bool_]:
    """Mark the parameters of some effects, shape (P,)."""
    marks = [np.zeros(len(arm.robot.rigid_parameters), dtype=bool)]
    marks += [np.full(len(one.parameters(arm.robot)), which(one)) for one in arm.effects]
    return np.concatenate(marks)
