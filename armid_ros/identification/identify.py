# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Offline identification: recordings in, a model with uncertainties out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.checks import check_motion, check_torque
from armid_ros.identification.damage import without_damage
from armid_ros.identification.identifiability import Unidentified, unidentified
from armid_ros.identification.least_squares import joint_triangles, Method, solve
from armid_ros.identification.physical import fit_bodies, PhysicalSettings
from armid_ros.identification.physical_certificate import PhysicalCertificate
from armid_ros.identification.regression import Regression, regressions
from armid_ros.identification.signals import Conditioning, conditioning, SignalSettings
from armid_ros.model import BaseParameters, group_columns, regroup
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
import numpy as np
import numpy.typing as npt

#: Parameters whose column the data separate from the others by less than this share are grouped
#: with them: 1e-4 of a column's length is far below what noise leaves of it.
EXCITATION_TOLERANCE = 1e-4


@dataclass(frozen=True)
class IdentificationSettings:
    """
    How a model is fitted.

    Attributes
    ----------
    method : {'ols', 'wls', 'irls'}
        Ordinary least squares, weighted by the noise of each joint, or robust as well.
    signals : SignalSettings
        Filtering and decimation.
    physical : PhysicalSettings or None
        Fit among parameters that bodies have, and effects within their bounds.

    """

    method: Method = 'wls'
    signals: SignalSettings = field(default_factory=SignalSettings)
    physical: PhysicalSettings | None = None


@dataclass(frozen=True)
class Fit:
    """
    How a model predicts one unbroken stretch of a recording.

    Attributes
    ----------
    source : str
        The recording.
    motion : Motion
        Filtered and decimated motion with measured torque, M samples.
    predicted : ndarray, shape (M, n)
        Torque of the model, filtered alike [N m].
    informative : ndarray of bool, shape (M, n)
        False where a joint is held at rest by friction, where any torque is right.

    """

    source: str
    motion: Motion
    predicted: FloatArray
    informative: npt.NDArray[np.bool_]

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted torque, shape (M, n) [N m]."""
        assert self.motion.tau is not None
        return self.motion.tau - self.predicted


@dataclass(frozen=True)
class Score:
    """
    How well a model predicts recordings.

    Attributes
    ----------
    relative_error_percent : float
        100 |tau - tau_hat| / |tau| over all joints and samples.
    joint_relative_error_percent : ndarray, shape (n,)
        The same of each joint.
    rms : ndarray, shape (n,)
        Root mean square residual of each joint [N m].

    """

    relative_error_percent: float
    joint_relative_error_percent: FloatArray
    rms: FloatArray

    @staticmethod
    def of(fits: Sequence[Fit]) -> Score:
        """Score one or more stretches together."""
        used = np.concatenate([fit.informative for fit in fits])
        residual = used * np.concatenate([fit.residual for fit in fits])
        tau = used * np.concatenate([fit.motion.tau for fit in fits if fit.motion.tau is not None])
        lengths = np.linalg.norm(tau, axis=0)
        return Score(
            float(100.0 * np.linalg.norm(residual) / np.linalg.norm(tau)),
            100.0 * np.linalg.norm(residual, axis=0) / np.where(lengths > 0.0, lengths, np.inf),
            np.sqrt(np.sum(residual**2, axis=0) / np.maximum(used.sum(axis=0), 1)),
        )


@dataclass(frozen=True)
class Identification:
    """
    A model fitted to recordings.

    Attributes
    ----------
    arm : ArmModel
        The model; of all standard parameters with the identified base parameters, those nearest
        to the description's.
    theory : BaseParameters
        What any motion of the arm can tell apart.
    base : BaseParameters
        What the data can tell apart, and how it groups the standard parameters.
    estimate : Estimate
        Base and effect parameters with covariance; that of a fit among bodies is what the data
        alone say.
    condition_number : float
        Of the weighted base regressor.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of each joint [N m].
    training : tuple of Fit
        Prediction of the data it was fitted to.
    used : Conditioning
        Filters that were used; validation data go through the same.
    settings : IdentificationSettings
        What was asked.
    notes : tuple of str
        What a person should know: joints at rest, outliers, grouped parameters.
    physical : PhysicalCertificate or None
        What shows that the links are bodies, where that was asked.

    """

    arm: ArmModel
    theory: BaseParameters
    base: BaseParameters
    estimate: Estimate
    condition_number: float
    joint_std: FloatArray
    training: tuple[Fit, ...]
    used: Conditioning
    settings: IdentificationSettings
    notes: tuple[str, ...]
    physical: PhysicalCertificate | None = None

    @property
    def unidentified(self) -> tuple[Unidentified, ...]:
        """What the data do not tell, and why."""
        return unidentified(self.theory, self.base, self.estimate)

    def predict(self, recordings: Sequence[Recording]) -> tuple[Fit, ...]:
        """Predict the torques of other recordings, filtered like the training data."""
        signals = SignalSettings(self.used.cutoff_hz, self.used.decimation)
        recordings, _ = without_damage(recordings, signals)
        problem = regressions(self.arm, self.base.independent, recordings, self.used)
        if not problem:
            raise IdentificationError(
                f'{recordings[0].source}: no stretch is long enough to be filtered at '
                f'{self.used.cutoff_hz:g} Hz'
            )
        return _fits(problem, self.estimate.values)


def identify(
    arm: ArmModel,
    recordings: Sequence[Recording],
    settings: IdentificationSettings | None = None,
    *,
    rng: np.random.Generator,
    progress: Callable[[float], None] | None = None,
) -> Identification:
    """
    Fit the rigid body and the effects of an arm to recordings.

    Parameters
    ----------
    arm : ArmModel
        Structure: robot and effects; its values are where unidentifiable directions stay.
    recordings : sequence of Recording
        Training data with torques.
    settings : IdentificationSettings, optional
        Method and filters.
    rng : numpy.random.Generator
        Draws the states over which base parameters are found.
    progress : callable, optional
        Told the share that is done, 0 to 1.

    Returns
    -------
    Identification
        Model, estimate with covariance, fit.

    Raises
    ------
    IdentificationError
        If the data cannot identify anything: too short, no motion, no torque, torque of the wrong
        sign or unit; the message says which and what to do.

    """
    settings = settings or IdentificationSettings()
    recordings, damage = without_damage(recordings, settings.signals)
    used = conditioning(list(recordings), settings.signals)
    notes = tuple(map(str, damage)) + check_motion(arm.robot, recordings, used)
    theory = arm.base_parameters(rng)
    problem = regressions(arm, theory.independent, recordings, used, progress)
    samples = sum(len(part.motion) for part in problem)
    if samples * arm.robot.n_joints < 2 * theory.rank:
        raise IdentificationError(
            f'{recordings[0].source}: {samples} samples remain after filtering at '
            f'{used.cutoff_hz:g} Hz and decimation by {used.decimation}; {theory.rank} parameters '
            'need more: record longer'
        )
    base = _excited(theory, problem)
    problem = [part.restrict(_positions(theory, base)) for part in problem]
    notes += check_torque(arm, recordings, problem)
    if base.rank < theory.rank:
        notes += (
            f'the motion tells {base.rank} of {theory.rank} parameters apart; '
            'the others are grouped',
        )
    solution = solve(problem, settings.method, _bounds(arm, base))
    if solution.outliers:
        notes += (f'{solution.outliers} torque samples were weighted down as outliers',)
    estimate = Estimate(base.parameters, solution.values, solution.covariance)
    theta, certificate = base.lift(solution.values, arm.theta), None
    if settings.physical is not None:
        theta, certificate = fit_bodies(
            arm, base, problem, solution.weights, estimate, settings.physical
        )
        estimate = Estimate(base.parameters, base.values(theta), solution.covariance)
        notes += certificate.sentences()
    return Identification(
        arm=arm.with_theta(theta),
        theory=theory,
        base=base,
        estimate=estimate,
        condition_number=solution.condition_number,
        joint_std=solution.joint_std,
        training=_fits(problem, estimate.values),
        used=used,
        settings=settings,
        notes=notes,
        physical=certificate,
    )


def _fits(problem: Sequence[Regression], values: FloatArray) -> tuple[Fit, ...]:
    return tuple(
        Fit(part.source, part.motion, part.columns @ values, part.informative) for part in problem
    )


def _bounds(arm: ArmModel, base: BaseParameters) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of base parameters; one that stands for a group has none."""
    free = np.full(len(arm.robot.rigid_parameters), np.inf)
    effects = [effect.bounds() for effect in arm.effects]
    lower = np.concatenate([-free, *(bounds[0] for bounds in effects)])[base.independent]
    upper = np.concatenate([free, *(bounds[1] for bounds in effects)])[base.independent]
    alone = np.count_nonzero(base.grouping, axis=1) == 1
    return np.where(alone, lower, -np.inf), np.where(alone, upper, np.inf)


def _positions(theory: BaseParameters, base: BaseParameters) -> list[int]:
    order = {int(column): position for position, column in enumerate(theory.independent)}
    return [order[int(column)] for column in base.independent]


def _excited(theory: BaseParameters, problem: Sequence[Regression]) -> BaseParameters:
    """Group further what this motion does not tell apart, such as the links of a joint at rest."""
    w = joint_triangles(problem)[:, :, :-1].reshape(-1, theory.rank)
    names = tuple(theory.standard[column] for column in theory.independent)
    data = group_columns(w, names, tolerance=EXCITATION_TOLERANCE)
    if data.rank == theory.rank:
        return theory
    return regroup(theory, data)
