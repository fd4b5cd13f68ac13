# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings in, a model with uncertainties out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.api.arguments import (
    arm_of,
    generator,
    RecordingLike,
    recordings_of,
    Rng,
    RobotLike,
    some_recordings_of,
    source_of,
    USUAL,
    with_sources_apart,
)
from armid_ros.api.table import Shown, Summary
from armid_ros.arm import ArmModel, Misfit, save_model
from armid_ros.arm.export import arm_mjcf, arm_urdf
from armid_ros.diagnosis import known_misfit
from armid_ros.estimate import Estimate
from armid_ros.files import staged, write_file
from armid_ros.identification import (
    Fit,
    Grade,
    grade,
    Identification,
    identification_document,
    IdentificationSettings,
    PhysicalSettings,
    Score,
    SignalSettings,
    write_document,
)
from armid_ros.identification import identify as run
from armid_ros.identification.fitting.least_squares import Estimator
from armid_ros.identification.identified_from import with_contents
from armid_ros.identification.parameters_file import parameters_of
from armid_ros.identification.rows.checks import check_held_out
from armid_ros.recording import Recording, require_once

if TYPE_CHECKING:
    from armid_ros.report.page import Section
    import pandas


@dataclass(frozen=True, repr=False, eq=False)
class IdentificationResult(Shown):
    """
    An identified model, and what it was made from.

    Attributes
    ----------
    core : Identification
        Everything that the identification found.
    description : ArmModel
        The model before.
    recordings : tuple of Recording
        What it was fitted to.
    held_out : tuple of Recording
        What it only predicted.
    validation : dict of str to tuple of Fit
        Predictions of the held-out recordings, by their names.

    Examples
    --------
    >>> import armid_ros as ar
    >>> model = ar.identify('my_arm.urdf', 'monday', validate='tuesday')
    >>> model.relative_error_percent < 1.0
    True
    >>> sorted(path.name for path in model.save('result').iterdir())
    ['identification.json', 'model.yaml', 'report.html']

    """

    core: Identification
    description: ArmModel
    recordings: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    validation: dict[str, tuple[Fit, ...]]

    @property
    def arm(self) -> ArmModel:
        """Return the identified model."""
        return self.core.arm

    @property
    def estimate(self) -> Estimate:
        """Return the base and effect parameters with covariance."""
        return self.core.estimate

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what a person should know."""
        return self.core.notes

    @property
    def training(self) -> Score:
        """How well it fits what it was fitted to."""
        return Score.of(self.core.training)

    @property
    def held_out_score(self) -> Score | None:
        """How well it predicts what it was not fitted to; None without such recordings."""
        fits = [fit for part in self.validation.values() for fit in part]
        return Score.of(fits) if fits else None

    @property
    def relative_error_percent(self) -> float:
        """100 |tau - tau_hat| / |tau|, of the held-out recordings where there are any."""
        return (self.held_out_score or self.training).relative_error_percent

    @property
    def misfit(self) -> Misfit:
        """Return what the model leaves, with what the recordings tell of its parameters."""
        known = parameters_of(self.arm.robot.name, self.document())
        information = known.information(self.arm.parameters)
        unusable = self.grade == 'unusable'
        return replace(self._misfit, information=information, unusable=unusable)

    @cached_property
    def _misfit(self) -> Misfit:
        return known_misfit(self.core, self.recordings, self.held_out)

    @property
    def grade(self) -> str:
        """How far it can be believed, in a word."""
        return self._graded.word

    @cached_property
    def _graded(self) -> Grade:
        return grade(self.core, self.description, self.recordings, self.validation, self.held_out)

    def predict(self, recordings: RecordingLike | Sequence[RecordingLike]) -> tuple[Fit, ...]:
        """Predict the torques of other recordings."""
        return self.core.predict(some_recordings_of(recordings, self.arm.robot))

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the parameters as a pandas table: name, joint, value, std, unit."""
        from pandas import DataFrame

        return DataFrame(self.document()['parameters'])

    def document(self) -> dict[str, Any]:
        """Return what identification.json holds."""
        return identification_document(self.core, self._robot, self.validation, grade=self._graded)

    def urdf(self, path: str | Path | None = None) -> str:
        """Return the description with the identified values; write it where a path is given."""
        text = arm_urdf(self.arm).text
        if path is not None:
            write_file(Path(path), text)
        return text

    def report(self, path: str | Path = 'report.html') -> Path:
        """Write the page with all curves, numbers and doubts; return where it is."""
        from armid_ros.report import identification_report

        page = identification_report(
            self.core,
            description=self.description,
            robot=self._robot,
            recordings=self.recordings,
            validation=self.validation,
            validation_recordings=self.held_out,
        )
        write_file(Path(path), page)
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write model.yaml, identification.json and report.html as ``armid identify`` does."""
        with staged(Path(folder)) as result:
            part = result.folder
            save_model(part / 'model.yaml', self.arm, self._robot, self.estimate, self._misfit)
            write_document(part / 'identification.json', with_contents(self.document()))
            self.report(part / 'report.html')
            if self.core.physical is not None:
                self.urdf(part / 'identified.urdf')
                text = arm_mjcf(self.arm).text
                write_file(part / 'identified.mjcf.xml', text)
            result.keep()
        return result.out

    def summary(self) -> Summary:
        """Return errors joint by joint, with the friction."""
        score = self.held_out_score or self.training
        said = f'{self.training.relative_error_percent:.2f} % relative error'
        if self.held_out_score is not None:
            said += f', {self.held_out_score.relative_error_percent:.2f} % held out'
        robot = self.arm.robot
        rows = [
            (
                joint,
                f'{score.rms[k]:.3g} {robot.torque_units[k]}',
                f'{score.joint_relative_error_percent[k]:.2g} %',
                self._value('viscous_coefficient', joint),
                self._value('coulomb_torque', joint),
            )
            for k, joint in enumerate(robot.joints)
        ]
        count = len(self.estimate.parameters)
        below = (
            f'{count} parameters, condition number {self.core.condition_number:.4g}; ± is one '
            'standard deviation'
        )
        return Summary(
            f'{robot.name}: {said}',
            self.grade,
            ('joint', 'residual', 'relative', 'viscous', 'Coulomb'),
            rows,
            (below, *self.notes),
        )

    def tone(self) -> str:
        """Return the colour of the grade."""
        from armid_ros.report.identification_report import TONES

        return TONES[self.grade]

    def sections(self) -> list[Section]:
        """Return the errors of the joints, and all parameters."""
        from armid_ros.report.sections.fit import JointErrors
        from armid_ros.report.sections.parameters import ParameterSection

        training: dict[str, list[Fit]] = {}
        for fit in self.core.training:
            training.setdefault(fit.source, []).append(fit)
        described = self.core.base.values(self.description.theta)
        return [
            JointErrors(self.arm.robot, training, self.validation),
            ParameterSection(
                self.estimate, described, self.core.unidentified, self.arm.robot.links
            ),
        ]

    @property
    def _robot(self) -> str:
        return source_of(self.description.robot)

    def _value(self, name: str, joint: str) -> str:
        for k, parameter in enumerate(self.estimate.parameters):
            if (parameter.name, parameter.joint) == (name, joint):
                value, std = self.estimate.values[k], self.estimate.std[k]
                return f'{value:.3g} ± {std:.1g}' if abs(value) > 1.96 * std else '~ 0'
        return '-'


def identify(
    arm: RobotLike,
    recordings: RecordingLike | Sequence[RecordingLike],
    *,
    validate: RecordingLike | Sequence[RecordingLike] = (),
    effects: str = USUAL,
    method: Estimator = 'wls',
    cutoff: float | None = None,
    decimation: int | None = None,
    physical: bool | PhysicalSettings = False,
    rng: Rng = 0,
) -> IdentificationResult:
    """
    Fit the rigid body and the effects of an arm to recordings.

    Parameters
    ----------
    arm : model, robot, name or path
        What is fitted; a robot without a model gets ``effects``.
    recordings : recording or path, or several
        Bags or tables with torques.
    validate : recording or path, or several
        To be predicted and not to be fitted.
    effects : str
        Catalogue names with commas, for a robot without a model.
    method : {'ols', 'wls', 'irls', 'iv'}
        Least squares with all joints alike, weighted by their noise, or robust as well;
        instrumental variables, closed-loop output error, extended Kalman filter.
    cutoff : float, optional
        Of the position filter [Hz]; from the noise by default.
    decimation : int, optional
        Keep one sample of this many.
    physical : bool or PhysicalSettings
        Fit links that can be bodies; ``urdf`` then describes one.
    rng : int or Generator
        Seed, or source of randomness.

    Returns
    -------
    IdentificationResult
        Prints as a table; ``report``, ``save``, ``to_dataframe``, ``urdf``.

    Raises
    ------
    IdentificationError
        If the data cannot identify anything, or no joint moves in what is held out; the message
        says why and what to do.
    RecordingError
        If there is no recording, or one is given twice, or held out and fitted.

    Examples
    --------
    >>> import armid_ros as ar
    >>> model = ar.identify('my_arm.urdf', 'monday', validate='tuesday')
    >>> model.grade
    'good'

    """
    model = arm_of(arm, effects)
    training, held_out = with_sources_apart(
        some_recordings_of(recordings, model.robot), recordings_of(validate, model.robot)
    )
    require_once(training, held_out)
    check_held_out(model.robot, held_out)
    known = PhysicalSettings() if physical is True else physical or None
    settings = IdentificationSettings(method, SignalSettings(cutoff, decimation), known)
    result = run(model, training, settings, rng=generator(rng))
    validation = {recording.source: result.predict([recording]) for recording in held_out}
    return IdentificationResult(result, model, tuple(training), tuple(held_out), validation)
