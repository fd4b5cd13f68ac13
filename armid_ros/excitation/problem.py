# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Design problem: settings, parameters to identify, noise and limits."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import TrajectoryError
from armid_ros.excitation.fourier import FourierTrajectory, MARGIN
from armid_ros.excitation.limits import Limits
from armid_ros.excitation.schedule import MAX_DURATION
from armid_ros.excitation.search.criteria import CRITERIA, Criterion, Information
from armid_ros.model import BaseParameters, group_columns, levelled, random_motion
from armid_ros.motion import FloatArray, Motion, read_only
import numpy as np
import numpy.typing as npt

#: Target parameter sets of a design.
TARGETS = {
    'all': 'all base parameters of the rigid body, and those of the effects',
    'gravity': 'masses and first moments, as identified from slow motion, and the effects',
    'effects': 'parameters of the effects only; the rigid body is known',
}


@dataclass(frozen=True)
class DesignSettings:
    """
    Settings of a design: trajectory, limits, criterion and effort of the search.

    Attributes
    ----------
    period : float
        Period of the trajectory [s].
    harmonics : int
        Number of harmonics per joint.
    n_periods : int
        Number of periods.
    run_in : float
        Shortest duration of the run-in and of the run-out [s]; they are made longer if the limits
        require it.
    speed : str or float
        'slow', 'medium', 'fast' or a share of the velocity and acceleration limits.
    clearance : float
        Distance to keep between bodies that may touch [m].
    criterion : str
        'D', 'A', 'E', 'condition', or 'T' to distinguish the arm from a rival.
    balance : float
        Criterion 'D' minimises -log det / r + balance * log(condition number), with r parameters.
        Among trajectories of similar information, it prefers one without a poorly identifiable
        direction. 0: D-optimality only.
    target : str
        'all', 'gravity' or 'effects'.
    focus : tuple of str
        Names of effects to identify as precisely as possible, while the other parameters are
        fitted too. Empty: all parameters count. Not with criterion 'T'.
    noise : ndarray, shape (n,), or None
        Standard deviation of the torque noise of each joint [N m or N]; None: 1 % of the torque
        limit, or of the largest such limit where a joint has none.
    rate : float
        Samples per second that the noise refers to [Hz], for the predicted deviations.
    candidates : int
        Number of random feasible trajectories at the start; proportionally fewer for an arm with
        more than 10 joints.
    starts : int
        Number of the best candidates that are improved; after every second round only the better
        half continues.
    iterations : int
        Iterations per start. The result depends on this number, not on the computing time.
    time_budget : float
        Processor time [s]; infinite by default. A search that uses more is stopped as soon as it
        has found a trajectory. The same seed may then give another trajectory; `Design.stopped`
        states this.

    """

    period: float = 20.0
    harmonics: int = 5
    n_periods: int = 2
    run_in: float = 2.0
    speed: str | float = 'fast'
    clearance: float = 0.01
    criterion: str = 'D'
    balance: float = 1.0
    target: str = 'all'
    focus: tuple[str, ...] = ()
    noise: FloatArray | None = None
    rate: float = 100.0
    starts: int = 4
    candidates: int = 60
    iterations: int = 200
    time_budget: float = np.inf

    def __post_init__(self) -> None:
        """Check that criterion and target exist, and that the numbers are valid."""
        for kind, name, known in (
            ('criterion', self.criterion, CRITERIA),
            ('target', self.target, TARGETS),
        ):
            if name not in known:
                raise TrajectoryError(f"there is no {kind} '{name}'; choose {', '.join(known)}")
        if self.focus and self.criterion == 'T':
            raise TrajectoryError("focus is not available with criterion 'T'; choose one of them")
        self._require_numbers()

    def _require_numbers(self) -> None:
        """Raise a TrajectoryError if a number among the settings is outside its valid range."""
        for setting in ('harmonics', 'n_periods', 'starts', 'candidates', 'iterations'):
            if (value := getattr(self, setting)) < 1:
                raise TrajectoryError(f'{setting} is {value}, but has to be at least 1')
        for setting in ('period', 'run_in', 'rate'):
            if not 0.0 < (value := getattr(self, setting)) < np.inf:
                raise TrajectoryError(f'{setting} is {value}, but has to be positive and finite')
        for setting in ('time_budget', 'clearance', 'balance'):
            if not (value := getattr(self, setting)) >= 0.0:
                raise TrajectoryError(f'{setting} is {value}, but has to be 0 or more')
        duration = self.n_periods * self.period + 2.0 * self.run_in
        if not duration <= MAX_DURATION:
            raise TrajectoryError(
                f'{self.n_periods} periods of {self.period:g} s and run-ins of {self.run_in:g} s '
                f'last {duration:.3g} s; the maximum is one day'
            )

    @property
    def samples(self) -> int:
        """Number of samples of one period in a search."""
        return max(64, 12 * self.harmonics)


def whole_period(duration: float, n_periods: int, run_in: float, rate: float) -> float:
    """
    Return the period [s] of an excitation of given duration, rounded to whole samples.

    Parameters
    ----------
    duration : float
        Duration from rest to rest [s]; the run may become longer or shorter by half a sample per
        period.
    n_periods : int
        Number of periods.
    run_in : float
        Duration of the run-in, and of the run-out [s].
    rate : float
        Samples per second [Hz].

    Raises
    ------
    TrajectoryError
        If less than a second is left for a period.

    """
    period = (duration - 2.0 * run_in) / n_periods
    if not 1.0 <= period < np.inf:
        raise TrajectoryError(
            f'duration {duration:g} s leaves {period:.3g} s for each of {n_periods} '
            'periods; give a longer duration, or fewer periods'
        )
    return round(period * rate) / rate


@dataclass(frozen=True)
class DesignProblem:
    """
    Optimisation problem of an excitation: arm, limits, parameters, noise and cost.

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
        Return the optimisation problem for an arm: limits, noise, parameters and criterion.

        Raises
        ------
        TrajectoryError
            If the arm has no parameter in the target, or no motion separates arm and rival.

        """
        limits = Limits.of(arm.robot, speed=settings.speed)
        noise = torque_noise(arm, settings)
        if (settings.criterion == 'T') != (rival is not None):
            raise TrajectoryError(
                "a rival model is required with criterion 'T', and not allowed with other criteria"
            )
        model = arm if rival is None else _joined(arm, rival)
        motion = random_motion(arm.robot, rng)
        columns = _target_columns(model, settings.target, motion)
        if not columns.any():
            raise TrajectoryError(
                f"{arm.robot.name} has no parameters for target '{settings.target}'; use another"
            )
        level = replace(model, robot=levelled(model.robot))
        flat = _target_columns(level, settings.target, motion).reshape(-1, columns.shape[-1])
        base = group_columns(flat, model.parameters)
        columns = (columns / noise[:, np.newaxis]).reshape(flat.shape)[:, base.independent]
        scale = 1.0 / np.sqrt(np.sum(columns**2, axis=0) / len(motion))
        wanted, values = np.ones(base.rank, dtype=bool), base.values(model.theta)
        if rival is not None:
            lacking = np.arange(len(model.parameters)) >= len(rival.parameters)
            wanted, values = lacking[base.independent], base.values(lacking * model.theta)
        elif settings.focus:
            names = [effect.name for effect in model.effects]
            for name in set(settings.focus) - set(names):
                raise TrajectoryError(
                    f"focus: the arm has no effect '{name}'; it has {', '.join(names) or 'none'}"
                )
            focused = parameter_mask(model, settings.focus)
            wanted = focused[base.independent]
        criterion = Criterion(settings.criterion, scale, wanted, values, settings.balance)
        problem = cls(model, settings, limits, base, read_only(noise), read_only(scale), criterion)
        problem._require_visible(columns.T @ columns)
        return problem

    def _require_visible(self, matrix: FloatArray) -> None:
        """Raise a TrajectoryError if random motions carry no information for the criterion."""
        criterion = self.criterion
        if criterion.name != 'T':
            if not criterion.wanted.any():
                raise TrajectoryError(
                    f'focus: no motion distinguishes {", ".join(self.settings.focus)} from the '
                    "rigid body; use target 'effects', which assumes a known rigid body"
                )
        elif not np.isfinite(criterion.cost(matrix)):
            names = ', '.join(effect.name for effect in self.arm.effects) or 'nothing'
            raise TrajectoryError(
                f'no motion distinguishes the model with {names} from its rival: the rival can '
                'produce the same torques; change the values of the effects that the rival lacks'
            )

    def columns(self, motion: Motion) -> FloatArray:
        """Return the regressor of a motion, divided by the torque noise, shape (N n, P)."""
        columns = _target_columns(self.arm, self.settings.target, motion)
        return (columns / self.noise[:, np.newaxis]).reshape(-1, columns.shape[-1])

    def recorded(self, trajectory: FourierTrajectory, n_periods: int) -> Information:
        """Return the Fisher information on the base parameters from n_periods recorded periods."""
        # six times as many samples as in the search
        count, margin = 6 * self.settings.samples, MARGIN * trajectory.n_joints
        columns = self.columns(trajectory.with_margins(count))[margin:-margin]
        weight = self.settings.rate * trajectory.period * n_periods / count
        return self._information(columns, weight)

    def information(self, motion: Motion, n_recorded: float | None = None) -> Information:
        """
        Return the Fisher information of a motion on the base parameters.

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


def _target_columns(arm: ArmModel, target: str, motion: Motion) -> FloatArray:
    """Return the regressor (N, n, P) with zero columns for parameters outside the target."""
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
        If the settings do not have one positive number for each joint.

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
    # assumed standard deviation of unknown torque noise, as a share of the torque limit
    return np.asarray(0.01 * np.where(finite, limit, fallback))


def _joined(arm: ArmModel, rival: ArmModel) -> ArmModel:
    """Return the rival model, extended by the effects that only `arm` has."""
    known = {(effect.name, effect.joints) for effect in rival.effects}
    joined = replace(rival, robot=arm.robot)
    for effect, values in zip(arm.effects, arm.values, strict=True):
        if (effect.name, effect.joints) not in known:
            joined = joined.with_effect(effect, values)
    return joined


def parameter_mask(arm: ArmModel, names: Collection[str]) -> npt.NDArray[np.bool_]:
    """Return a mask (P,) that is True for the parameters of the named effects."""
    rigid = np.zeros(len(arm.robot.rigid_parameters), dtype=bool)
    named = [np.full(len(e.parameters(arm.robot)), e.name in names) for e in arm.effects]
    return np.concatenate([rigid, *named])
