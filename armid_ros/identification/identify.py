# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Offline identification: recordings in, a model with uncertainties out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.covariance import scatter
from armid_ros.identification.fitting.excited import base_spread, determined, excited
from armid_ros.identification.fitting.held_out import cutoff_of_torques, halves_error, HalvesError
from armid_ros.identification.fitting.identifiability import Unidentified, unidentified
from armid_ros.identification.fitting.instruments import fit_by_instruments
from armid_ros.identification.fitting.least_squares import Estimator, ESTIMATORS, Method
from armid_ros.identification.fitting.nonlinear import (
    fit_values,
    FittedValues,
    through,
    torques,
    ungrouped,
)
from armid_ros.identification.fitting.quasi_static import with_uncertain_inertia
from armid_ros.identification.physical.fit_among_bodies import fit_to_bodies, PhysicalSettings
from armid_ros.identification.physical.physical_certificate import PhysicalCertificate
from armid_ros.identification.rows.checks import (
    beyond_limits,
    check_motion,
    check_stamps,
    check_torque,
    too_short_to_tell,
)
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.regression import (
    Fit,
    predictions,
    Regression,
    regressions,
    Score,
)
from armid_ros.identification.rows.signals import (
    Conditioning,
    conditioning,
    no_stretch,
    SignalSettings,
)
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np

#: Share of torque error that links which are bodies may cost, where they are preferred: simulators
#: take nothing else, and a model that lacks an effect costs more.
_CHEAP = 0.1


@dataclass(frozen=True)
class IdentificationSettings:
    """
    How a model is fitted.

    Attributes
    ----------
    method : {'ols', 'wls', 'irls', 'iv'}
        Least squares: ordinary, weighted by the noise of each joint, or robust as well;
        instrumental variables.
    signals : SignalSettings
        Filtering and decimation.
    physical : PhysicalSettings or None
        Fit among parameters that bodies have, and effects within their bounds.
    prefers_bodies : bool
        Fit among such parameters where the torque error grows by a tenth at most.

    """

    method: Estimator = 'wls'
    signals: SignalSettings = field(default_factory=SignalSettings)
    physical: PhysicalSettings | None = None
    prefers_bodies: bool = False

    def __post_init__(self) -> None:
        """Check the method, and its combination with physical constraints."""
        if self.method not in ESTIMATORS:
            raise IdentificationError(
                f"no method '{self.method}'; use one of {', '.join(ESTIMATORS)}"
            )
        if self.physical is not None and self.method == 'iv':
            raise IdentificationError(
                'physical constraints are not available with method iv; use ols, wls or irls'
            )

    @property
    def least_squares(self) -> Method:
        """Return the least-squares method that the method is, or starts from."""
        return 'wls' if self.method == 'iv' else self.method

    @property
    def holds_description(self) -> bool:
        """Whether parameters stay at the description if it is more certain."""
        return self.physical is None and self.method != 'iv'


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
    halves : HalvesError
        Torque error when either half of the data predicts the other.
    scatter : ndarray, shape (K, r)
        What values vary by from recording to recording; see `scatter`.
    physical : PhysicalCertificate or None
        What shows that the links are bodies, where that was asked.
    bodies_cost : float or None
        Share by which the torque error of links that are bodies is larger; None if not tried.
    passes : int
        Linearisations of the arm that the fit took; 1 if its torque is linear in its parameters.

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
    halves: HalvesError
    scatter: FloatArray
    physical: PhysicalCertificate | None = None
    bodies_cost: float | None = None
    passes: int = 1

    def __repr__(self) -> str:
        """Return a summary of a few lines."""
        error = Score.of(self.training).relative_error_percent
        return (
            f'Identification of {self.arm.robot.name}: {error:.2f} % relative error, condition '
            f'number {self.condition_number:.4g}\n{self.estimate}'
        )

    @property
    def unidentified(self) -> tuple[Unidentified, ...]:
        """Return the unidentified parameters with reasons."""
        return unidentified(self.theory, self.base, self.estimate)

    def predict(self, recordings: Sequence[Recording]) -> tuple[Fit, ...]:
        """Predict the torques of other recordings, filtered like the training data."""
        signals = SignalSettings(self.used.cutoff_hz, self.used.decimation)
        recordings, _ = without_damage(recordings, signals)
        found = predictions(self.arm, recordings, self.used)
        if not found:
            raise no_stretch(recordings[0], self.used)
        return tuple(found)


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
    notes = damage + check_motion(arm.robot, recordings)
    notes += beyond_limits(arm.robot, recordings) + too_short_to_tell(recordings)
    theory = arm.base_parameters(rng)
    # inertia of a motion that is taken as slow: as described, unless bodies are fitted to weight
    described = arm.quasi_static and settings.physical is None
    whole = replace(arm, quasi_static=False) if described else arm
    if settings.signals.cutoff_hz is None:
        used = cutoff_of_torques(whole, theory.independent, recordings, used)
    columns = regressions(whole, theory.independent, recordings, used, progress)
    _require_samples(theory, recordings, columns, used)
    base, problem = excited(theory, columns)
    notes += check_torque(arm, recordings, problem)
    bodies: _Bodies | None = None
    if described:
        problem = through(problem, torques(whole, recordings, used), base.values(whole.theta))
        free = ungrouped(whole, whole.base_parameters(rng))
        fit = fit_values(whole, base, problem, recordings, used, settings.least_squares, free)
        fit, remarks = with_uncertain_inertia(whole, fit, recordings, used)
        notes += remarks
    else:
        data = base, problem, recordings, used
        if settings.physical is not None or settings.prefers_bodies:
            bodies = _bodies(arm, theory, data, settings, rng)
        if bodies is None or (bodies.cost > _CHEAP and settings.physical is None):
            theory, fit = _fitted(arm, theory, data, settings, rng)
        else:
            settings, theory, fit = bodies.settings, bodies.theory, bodies.fit
            notes += bodies.certificate.sentences()
    if settings.method == 'iv':
        fit = fit_by_instruments(fit, recordings, used)
    spread = base_spread(whole, fit.base) if settings.holds_description else None
    prior = fit.base.values(whole.theta)
    return Identification(
        arm=fit.arm,
        theory=theory,
        base=fit.base,
        estimate=Estimate(fit.base.parameters, fit.values, fit.solution.covariance),
        condition_number=fit.solution.condition_number,
        joint_std=fit.solution.joint_std,
        training=fit.fits,
        used=used,
        settings=settings,
        notes=notes + _remarks(fit, theory),
        halves=halves_error(fit.problem, fit.solution.weights, prior, spread),
        physical=None if bodies is None or settings.physical is None else bodies.certificate,
        bodies_cost=None if bodies is None else bodies.cost,
        passes=fit.passes,
        scatter=scatter(fit.problem, fit.solution.weights, fit.solution.values),
    )


class _Bodies(NamedTuple):
    """A fit with physically consistent links, and the relative increase of its error."""

    settings: IdentificationSettings
    theory: BaseParameters
    fit: FittedValues
    certificate: PhysicalCertificate
    cost: float


def _bodies(
    arm: ArmModel,
    theory: BaseParameters,
    data: tuple[BaseParameters, Sequence[Regression], Sequence[Recording], Conditioning],
    settings: IdentificationSettings,
    rng: np.random.Generator,
) -> _Bodies | None:
    """Fit physically consistent links; None if not requested and impossible."""
    if settings.method == 'iv':
        return None
    known = settings.physical or PhysicalSettings()
    asked = replace(settings, physical=known)
    theory, fit = _fitted(arm, theory, data, asked, rng)
    try:
        fit, proof = fit_to_bodies(arm, fit, *data[2:], asked.least_squares, known, rng)
    except IdentificationError:
        if settings.physical is not None:
            raise
        return None
    return _Bodies(asked, theory, fit, proof, max(proof.misfit_ratio, proof.held_out_ratio) - 1.0)


def _fitted(
    arm: ArmModel,
    theory: BaseParameters,
    data: tuple[BaseParameters, Sequence[Regression], Sequence[Recording], Conditioning],
    settings: IdentificationSettings,
    rng: np.random.Generator,
) -> tuple[BaseParameters, FittedValues]:
    """Fit what data determine better than the description; return theory and fit."""
    base, problem, recordings, used = data
    method = settings.least_squares

    def fitted(arm: ArmModel, base: BaseParameters, problem: Sequence[Regression]) -> FittedValues:
        if not settings.holds_description:
            return fit_values(arm, base, problem, recordings, used, method)
        told, problem, solution = determined(arm, base, problem, method)
        free = None if told.rank == base.rank else ungrouped(arm, base)
        return fit_values(arm, told, problem, recordings, used, method, free, solution)

    fit = fitted(arm, base, problem)
    rigid = len(arm.robot.rigid_parameters)
    if np.all(np.any(theory.grouping[:, rigid:], axis=0)):
        return theory, fit
    # again with what the described arm does not show, such as saturation that it never reaches
    now = fit.arm.base_parameters(rng)
    if now.rank <= theory.rank:
        return theory, fit
    columns = regressions(fit.arm, now.independent, recordings, used)
    return now, fitted(fit.arm, *excited(now, columns))


def _require_samples(
    theory: BaseParameters,
    recordings: Sequence[Recording],
    columns: Sequence[Regression],
    used: Conditioning,
) -> None:
    """Raise an error for fewer than two torques per parameter."""
    samples = sum(len(part.motion) for part in columns)
    left = {part.source for part in columns}
    for recording in recordings:
        if recording.source not in left:
            check_stamps([recording], used)
            raise no_stretch(recording, used)
    if sum(part.tau.size for part in columns) < 2 * theory.rank:
        check_stamps(recordings, used)
        raise IdentificationError(
            f'{recordings[0].source}: {samples} samples remain after filtering at '
            f'{used.cutoff_hz:g} Hz and decimation by {used.decimation}; {theory.rank} parameters '
            'need more: record longer, or lower --decimation'
        )


def _remarks(fit: FittedValues, theory: BaseParameters) -> tuple[str, ...]:
    """Return notes on grouped parameters, outliers and convergence."""
    remarks = []
    if fit.base.rank < theory.rank:
        remarks.append(
            f'the motion tells {fit.base.rank} of {theory.rank} parameters apart; '
            'the others are grouped, or stay as described'
        )
    if fit.solution.outliers:
        remarks.append(f'{fit.solution.outliers} torque samples were weighted down as outliers')
    if not fit.settled:
        remarks.append(
            f'the fit has not settled after {fit.passes} linearisations: the effects '
            'change one another too much in these data; leave some out, or record more'
        )
    return tuple(remarks)
