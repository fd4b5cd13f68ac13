# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Offline identification of a model with uncertainties from recordings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.estimate import Estimate
from armid_ros.identification.fitting.held_out import cutoff_of_torques, halves_error, jackknife
from armid_ros.identification.fitting.identifiability import (
    base_spread,
    excited,
    excludes_zero,
    fit_determined,
    near_deviation,
    NOT_SHOWN,
    Reason,
    Unidentified,
)
from armid_ros.identification.fitting.instruments import fit_by_instruments
from armid_ros.identification.fitting.least_squares import Estimator, ESTIMATORS, Method
from armid_ros.identification.fitting.nonlinear import (
    exact_at,
    fit_values,
    FittedValues,
    torques,
    unidentifiable_directions,
)
from armid_ros.identification.physical.fit_among_bodies import (
    fit_consistent_links,
    PhysicalCertificate,
    PhysicalSettings,
)
from armid_ros.identification.rows.checks import (
    beyond_limits,
    check_motion,
    check_torque,
    short_recording_note,
)
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.regression import (
    Fit,
    predictions,
    Regression,
    regressions,
    Score,
    weighted_rows,
)
from armid_ros.identification.rows.signals import (
    Conditioning,
    conditioning,
    no_stretch,
    SignalSettings,
)
from armid_ros.identification.rows.stamps import check_recordings, uneven_stamps
from armid_ros.identification.rows.temperature import at_mean_temperature
from armid_ros.model import BaseParameters
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np


@dataclass(frozen=True)
class IdentificationSettings:
    """
    Method, filters and physical constraints of an identification.

    Attributes
    ----------
    method : {'ols', 'wls', 'irls', 'iv'}
        Ordinary least squares; weighted by the noise of each joint; weighted and robust;
        instrumental variables.
    signals : SignalSettings
        Filtering and decimation.
    physical : PhysicalSettings or None
        Constraints for a physically consistent fit; None for an unconstrained fit.
    prefers_bodies : bool
        Whether to fit physically consistent links, as simulators need, if the torque error grows
        by a tenth at most. With a model that lacks an effect, it grows by more.

    """

    method: Estimator = 'wls'
    signals: SignalSettings = field(default_factory=SignalSettings)
    physical: PhysicalSettings | None = None
    prefers_bodies: bool = False

    def __post_init__(self) -> None:
        """Raise an error for an unknown method, or for physical constraints with method 'iv'."""
        if self.method not in ESTIMATORS:
            raise IdentificationError(
                f"method '{self.method}' does not exist; use {', '.join(ESTIMATORS)}"
            )
        if self.physical is not None and self.method == 'iv':
            raise IdentificationError(
                'physical constraints are not available with method iv; use ols, wls or irls'
            )

    @property
    def least_squares(self) -> Method:
        """Return the least-squares method; 'wls' for the first fit of instrumental variables."""
        return 'wls' if self.method == 'iv' else self.method

    @property
    def holds_description(self) -> bool:
        """Whether the fit keeps a described value that is more certain than its estimate."""
        return self.physical is None and self.method != 'iv'


@dataclass(frozen=True)
class Identification:
    """
    Result of an identification: a model fitted to recordings.

    Attributes
    ----------
    arm : ArmModel
        Identified model. Of all standard parameters with the identified base parameters, it has
        those nearest to the description.
    theory : BaseParameters
        Base parameters that are identifiable in some motion of the arm.
    base : BaseParameters
        Base parameters that the data identify, with their grouping of standard parameters.
    estimate : Estimate
        Base and effect parameters with covariance; for a physically consistent fit, the covariance
        of the data alone.
    condition_number : float
        Condition number of the weighted base regressor.
    joint_std : ndarray, shape (n,)
        Standard deviation of the residual of each joint [N m].
    training : tuple of Fit
        Predictions of the training data.
    used : Conditioning
        Filters of the training data; held-out data are filtered alike.
    settings : IdentificationSettings
        Settings of the fit.
    notes : tuple of str
        Notes for the user: joints at rest, outliers, grouped parameters.
    halves : Score
        Torque error when either half of the data predicts the other.
    scatter : ndarray, shape (K, r)
        Jackknife changes of the values without each of K recordings; see `jackknife`.
    physical : PhysicalCertificate or None
        Evidence that the links are physically consistent, if requested.
    bodies_cost : float or None
        Increase of the torque error by physically consistent links, as a share; None if not tried.
    passes : int
        Number of linearisations in the fit; 1 if the torque is linear in the parameters.

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
    halves: Score
    scatter: FloatArray
    physical: PhysicalCertificate | None = None
    bodies_cost: float | None = None
    passes: int = 1

    def __repr__(self) -> str:
        """Return robot, relative error, condition number and estimate in a few lines."""
        error = Score.of(self.training).relative_error_percent
        return (
            f'Identification of {self.arm.robot.name}: {error:.2f} % relative error, condition '
            f'number {self.condition_number:.4g}\n{self.estimate}'
        )

    @property
    def unidentified(self) -> tuple[Unidentified, ...]:
        """Standard and base parameters that the data do not identify, with reasons."""
        theory, base, estimate = self.theory, self.base, self.estimate
        found = [
            Unidentified(name, 'no motion of this arm shows it')
            for name, shown in zip(theory.standard, np.any(theory.grouping, axis=0), strict=True)
            if not shown
        ]
        grouped, kept = np.any(base.grouping, axis=0), set(base.independent.tolist())
        for name, column in zip(theory.parameters, theory.independent.tolist(), strict=True):
            if column not in kept:
                together: Reason = 'this motion shows it only together with others'
                found.append(Unidentified(name, together if grouped[column] else NOT_SHOWN))
        clear = excludes_zero(estimate.values, estimate.std)
        found += [
            Unidentified(name, 'not distinguishable from zero')
            for name, sure in zip(estimate.parameters, clear, strict=True)
            if not sure
        ]
        return tuple(found)

    def predict(self, recordings: Sequence[Recording]) -> tuple[Fit, ...]:
        """Predict torques of other recordings, with the filters of the training data."""
        check_recordings(recordings)
        recordings, _ = without_damage(recordings, self.used)
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
        Robot and effects; unidentifiable combinations of parameters keep the values of this model.
    recordings : sequence of Recording
        Training data with torques.
    settings : IdentificationSettings, optional
        Method and filters.
    rng : numpy.random.Generator
        Generator of the random states from which base parameters are found.
    progress : callable, optional
        Called with the finished share, 0 to 1.

    Returns
    -------
    Identification
        Model, estimate with covariance, and predicted torque.

    Raises
    ------
    IdentificationError
        If nothing is identifiable: too short, no motion, no torque, torque of the wrong sign or
        unit; the message contains cause and remedy.

    """
    settings, arm = settings or IdentificationSettings(), at_mean_temperature(arm, recordings)
    used = conditioning(recordings, settings.signals)
    recordings, notes = without_damage(recordings, used)
    used = conditioning(recordings, settings.signals) if notes else used
    notes += check_motion(arm.robot, recordings) + beyond_limits(arm.robot, recordings)
    notes += short_recording_note(recordings)
    theory = arm.base_parameters(rng)
    # a quasi-static fit uses the described inertia, unless physical links are fitted to the weight
    described = arm.quasi_static and settings.physical is None
    whole = replace(arm, quasi_static=False) if described else arm
    if settings.signals.cutoff_hz is None:
        used = cutoff_of_torques(whole, theory.independent, recordings, used)
    columns = regressions(whole, theory.independent, recordings, used, progress)
    _require_samples(theory, recordings, columns, used)
    base, problem = excited(theory, columns)
    notes += check_torque(arm, recordings, problem)
    data, bodies = (base, problem, recordings, used), None
    if described:
        fit, remarks = _fit_quasi_static(whole, data, settings.least_squares, rng)
        notes += remarks
    else:
        bodies = _fit_consistent_links(arm, theory, data, settings, rng)
        if bodies is not None and (settings.physical or bodies[3].cost <= 0.1):
            settings, theory, fit, _ = bodies
            notes += (*bodies[3].constraint_notes, *bodies[3].notes)
        else:
            theory, fit = _fitted(arm, theory, data, settings, rng)
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
        physical=None if bodies is None or settings.physical is None else bodies[3],
        bodies_cost=None if bodies is None else bodies[3].cost,
        passes=fit.passes,
        scatter=jackknife(fit.problem, fit.solution.weights, fit.solution.values),
    )


def _fit_consistent_links(
    arm: ArmModel,
    theory: BaseParameters,
    data: tuple[BaseParameters, Sequence[Regression], Sequence[Recording], Conditioning],
    settings: IdentificationSettings,
    rng: np.random.Generator,
) -> tuple[IdentificationSettings, BaseParameters, FittedValues, PhysicalCertificate] | None:
    """Fit physically consistent links; None if not requested, or if optional and infeasible."""
    if settings.method == 'iv' or not (settings.physical or settings.prefers_bodies):
        return None
    constraints = settings.physical or PhysicalSettings()
    physical = replace(settings, physical=constraints)
    theory, fit = _fitted(arm, theory, data, physical, rng)
    try:
        found = fit_consistent_links(arm, fit, *data[2:], physical.least_squares, constraints)
    except IdentificationError:
        if settings.physical is not None:
            raise
        return None
    return physical, theory, *found


def _fitted(
    arm: ArmModel,
    theory: BaseParameters,
    data: tuple[BaseParameters, Sequence[Regression], Sequence[Recording], Conditioning],
    settings: IdentificationSettings,
    rng: np.random.Generator,
) -> tuple[BaseParameters, FittedValues]:
    """Return the identifiable base parameters, and a fit of the parameters the data excite."""
    base, problem, recordings, used = data
    method, rigid = settings.least_squares, len(arm.robot.rigid_parameters)
    refitted = False
    while True:
        kept, free, solution = base, None, None
        if settings.holds_description:
            kept, problem, solution = fit_determined(arm, base, problem, method)
            free = None if kept.rank == base.rank else unidentifiable_directions(arm, base)
        fit = fit_values(arm, kept, problem, recordings, used, method, free, solution)
        if refitted or np.all(np.any(theory.grouping[:, rigid:], axis=0)):
            return theory, fit
        # fit again with effects that have no column at the described values, such as saturation
        # at a torque that is not reached
        identifiable = fit.arm.base_parameters(rng)
        if identifiable.rank <= theory.rank:
            return theory, fit
        arm, theory, refitted = fit.arm, identifiable, True
        base, problem = excited(theory, regressions(arm, theory.independent, recordings, used))


def _fit_quasi_static(
    arm: ArmModel,
    data: tuple[BaseParameters, Sequence[Regression], Sequence[Recording], Conditioning],
    method: Method,
    rng: np.random.Generator,
) -> tuple[FittedValues, tuple[str, ...]]:
    """Fit weight and friction to slow motions with described inertia; return fit and notes."""
    base, problem, recordings, used = data
    problem = exact_at(problem, torques(arm, recordings, used), base.values(arm.theta))
    free = unidentifiable_directions(arm, arm.base_parameters(rng))
    fit = fit_values(arm, base, problem, recordings, used, method, free)
    # Even in slow motion, the torque of inertia varies with position as weight does, so errors of
    # the described inertia bias the weight.
    # negligible deviation due to inertia, over the standard deviation of the fit
    negligible = 0.1
    rigid = len(arm.robot.rigid_parameters)
    everything = regressions(fit.arm, np.arange(rigid), recordings, used)
    # base parameters that a weighted fit of each rigid column gives
    columns, body = (
        weighted_rows(part, fit.solution.weights)[0] for part in (fit.problem, everything)
    )
    scale = np.linalg.norm(columns, axis=0)
    fitted = np.linalg.lstsq(columns / scale, body, rcond=None)[0] / scale[:, np.newaxis]
    bias = (fitted - fit.base.grouping[:, :rigid]) * near_deviation(arm.robot)
    added = bias @ bias.T
    plain = fit.solution.covariance
    solution = replace(fit.solution, covariance=plain + added)
    ratio = np.sqrt(np.diag(added) / np.maximum(np.diag(plain), 1e-300)).max()
    notes: tuple[str, ...] = ()
    if ratio > negligible:
        # the torque of inertia grows with the square of the speed
        speed = float(np.sqrt(negligible / ratio))
        slower = (
            'these torques have so little noise that inertia matters at any speed'
            if speed < 0.02
            else f'at {speed:.2g} times the speed, inertia would not matter'
        )
        notes = (
            'the motion is too fast for --quasi-static: the described inertia is subtracted, and '
            f'its possible error widens the intervals; {slower}',
        )
    return replace(fit, solution=solution), notes


def _require_samples(
    theory: BaseParameters,
    recordings: Sequence[Recording],
    columns: Sequence[Regression],
    used: Conditioning,
) -> None:
    """Raise an error if a recording is too short, or if there are too few samples to fit."""
    filtered = {part.source for part in columns}
    for recording in recordings:
        if recording.source not in filtered:
            raise no_stretch(recording, used)
    if sum(part.tau.size for part in columns) < 2 * theory.rank:
        uneven = filter(None, (uneven_stamps(one, used.cutoff_hz) for one in recordings))
        few = (
            f'{recordings[0].source}: {sum(len(part.motion) for part in columns)} samples remain '
            f'after filtering at {used.cutoff_hz:g} Hz and decimation by {used.decimation}; '
            f'{theory.rank} parameters need more: record longer, or lower --decimation'
        )
        raise IdentificationError(next(uneven, few))


def _remarks(fit: FittedValues, theory: BaseParameters) -> tuple[str, ...]:
    """Return notes on grouped parameters, outliers and failed convergence of a fit."""
    remarks = []
    if fit.base.rank < theory.rank:
        remarks.append(
            f'the motion identifies {fit.base.rank} of {theory.rank} parameters; '
            'the others are grouped, or stay as described'
        )
    if fit.solution.outliers:
        remarks.append(f'{fit.solution.outliers} outliers of torque have reduced weight')
    if not fit.converged:
        remarks.append(
            f'the fit has not converged after {fit.passes} linearisations: these data do not '
            'separate the effects; leave effects out, or record more'
        )
    return tuple(remarks)
