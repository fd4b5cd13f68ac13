# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification: from recordings to a model with uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TYPE_CHECKING

from armid_ros.api.arguments import (
    arm_of,
    Progress,
    RecordingLike,
    recordings_of,
    Rng,
    RobotLike,
    source_of,
    USUAL,
    with_unique_sources,
)
from armid_ros.api.table import aligned, data_frame, ResidualPart, ShownModel, Summary
from armid_ros.arm import ArmModel, Misfit, save_model
from armid_ros.arm.export import arm_mjcf, arm_urdf, Exported, torque_check
from armid_ros.diagnosis import known_misfit
from armid_ros.estimate import Estimate
from armid_ros.files import write_file
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
    Verification,
    write_document,
)
from armid_ros.identification import identify as run
from armid_ros.identification import verify as run_checks
from armid_ros.identification.fitting.identifiability import excludes_zero
from armid_ros.identification.fitting.least_squares import Estimator
from armid_ros.identification.known_payload import corrected, drive_gains, DriveGains, payloads_of
from armid_ros.identification.output import SCHEMA, with_digests
from armid_ros.identification.parameters_file import parameters_of
from armid_ros.identification.rows.checks import resting
from armid_ros.identification.rows.temperature import friction_per_kelvin
from armid_ros.recording import Recording, require_once
from armid_ros.recording.curves import draw_joints
from armid_ros.report.identification_report import identification_report, parameter_sections
from armid_ros.report.judgement import judge, residual_trends, USE
from armid_ros.report.notation import counted, digits, plain, pretty
from armid_ros.report.parameter_tables import estimate_text, full_label, joint_columns
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False, eq=False)
class IdentificationResult(ShownModel):
    """
    Result of an identification: model, recordings, fits and grade.

    Attributes
    ----------
    core : Identification
        Everything that the identification found.
    description : ArmModel
        The given model.
    recordings : tuple of Recording
        Recordings that the model is fitted to.
    held_out : tuple of Recording
        Recordings that are predicted and not fitted.
    validation : dict of str to tuple of Fit
        Predicted torques of the held-out recordings, by the name of the recording.
    verification : Verification or None
        Test for encoder noise, and simulations along the held-out recordings.
    gains : DriveGains or None
        Gains of the drives, known from payloads.

    Examples
    --------
    >>> import armid_ros as ar
    >>> model = ar.identify('my_arm.urdf', 'monday', validate='tuesday')
    >>> model.error_percent < 10.0
    True
    >>> sorted(path.name for path in model.save('result').iterdir())
    ['identification.json', 'identified.mjcf.xml', 'identified.urdf', 'model.yaml', 'report.html']

    """

    schema = SCHEMA

    core: Identification
    description: ArmModel
    recordings: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    validation: dict[str, tuple[Fit, ...]]
    verification: Verification | None = None
    gains: DriveGains | None = None

    @property
    def files(self) -> list[str]:
        """Return the names of the files that `fill` writes."""
        return ['identification.json', 'report.html', 'model.yaml', *self.exports]

    @property
    def arm(self) -> ArmModel:
        """Return the identified model."""
        return self.core.arm

    @property
    def estimate(self) -> Estimate:
        """Estimate of base parameters and effect parameters, with covariance."""
        return self.core.estimate

    @property
    def training(self) -> Score:
        """Torque errors of the model on the recordings from which it was identified."""
        return Score.of(self.core.training)

    @property
    def error_percent(self) -> float:
        """Largest torque error of a joint, used in the grade: 100 |tau - tau_hat| / |tau| [%]."""
        return self.graded.error_percent

    @property
    def misfit(self) -> Misfit:
        """Return the rms residual of each joint in the recordings, and the information matrix."""
        known = parameters_of(self.arm.robot.name, self.document())
        information = known.information(self.arm.parameters)
        unusable = self.grade == 'unusable'
        return replace(self._misfit, information=information, unusable=unusable)

    @cached_property
    def _misfit(self) -> Misfit:
        return known_misfit(self.core.arm, self.recordings, self.core.used, self.held_out)

    @property
    def grade(self) -> str:
        """Grade of the identification: good, poor or unusable."""
        return self.graded.word

    @cached_property
    def graded(self) -> Grade:
        """Grade of the identification with its reasons."""
        return grade(self.core, self.description, self.recordings, self.validation, self.held_out)

    def predict(self, recordings: RecordingLike | Sequence[RecordingLike]) -> tuple[Fit, ...]:
        """Predict the torques of other recordings; return a `Fit` per gap-free section."""
        return self.core.predict(recordings_of(recordings, self.arm.robot, required=True))

    def plot(self) -> npt.NDArray[np.object_]:
        """
        Plot measured and predicted torques of held-out data if available, else of training data.

        Returns
        -------
        ndarray of matplotlib.axes.Axes, shape (n,)

        """
        fits = next(iter(self.validation.values()), self.core.training)
        t = np.concatenate([fit.motion.t for fit in fits])
        curves = {
            'measured': (t, np.concatenate([fit.tau for fit in fits])),
            'predicted': (t, np.concatenate([fit.predicted for fit in fits])),
        }
        return draw_joints(self.arm.robot.joints, curves, 'torque [N m or N]')

    def __getitem__(self, key: tuple[str, str]) -> float:
        """Return the value of an effect or parameter on a joint: ['viscous_friction', 'elbow']."""
        return self.estimate[key]

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the parameters as a pandas table: name, joint, value, std, unit."""
        return data_frame(self.document()['parameters'])

    def _residuals(self) -> list[ResidualPart]:
        held_out = [fit for fits in self.validation.values() for fit in fits]
        return [
            (fit.source, fit.motion.t, fit.residual) for fit in (*self.core.training, *held_out)
        ]

    @cached_property
    def exports(self) -> dict[str, Exported]:
        """Return URDF and MJCF by file name; empty without a physically consistent fit."""
        if self.core.physical is None:
            return {}
        return {'identified.urdf': arm_urdf(self.arm), 'identified.mjcf.xml': arm_mjcf(self.arm)}

    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return the content of identification.json, without exports and digests of recordings."""
        robot = origin.of(source_of(self.description.robot)).robot
        document = identification_document(
            self.core, robot, self.validation, self.verification, self.graded
        )
        if self.gains:
            document['drive_gains'] = self.gains.document()
        return document

    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return the text of report.html with all curves, numbers and warnings."""
        without_place = {name: one.without_place for name, one in self.exports.items()}
        return identification_report(
            self.core,
            self.graded,
            description=self.description,
            recordings=[*self.recordings, *self.held_out],
            validation=self.validation,
            verification=self.verification,
            parameters=parameter_sections(self.core, self.description, without_place),
            origin=origin.of(source_of(self.description.robot)),
        )

    def fill(self, folder: Path, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Write model.yaml, identification.json, report.html and the exports into a folder."""
        document = self.document(origin)
        source = origin.of(source_of(self.description.robot)).source
        save_model(folder / 'model.yaml', self.arm, source, self.estimate, self._misfit)
        for name, one in self.exports.items():
            write_file(folder / name, one.text)
        if self.exports:
            document['exports'] = {
                name: {**torque_check(one, self.arm), 'left_out': list(one.left_out)}
                for name, one in self.exports.items()
            }
        write_file(folder / 'report.html', self.page(origin))
        document = with_digests(document)
        write_document(folder / 'identification.json', document)
        return document

    def summary(self, every: bool = False) -> Summary:
        """Return the terminal summary: errors, friction, next step; all parameters if `every`."""
        core, estimate, joints = self.core, self.estimate, self.arm.robot.joints
        others = self.graded.reasons[1:]
        held_out = [fit for fits in self.validation.values() for fit in fits]
        known = int(np.sum(excludes_zero(estimate.values, estimate.std)))
        count = f'{known} of {counted(len(estimate.parameters), "parameter")} differ from zero'
        unseen = core.theory.rank - core.base.rank
        if unseen > 0:
            count += f'; {unseen} more cannot be identified from this motion'
        read = [*self.recordings, *self.held_out]
        damaged = [one for one in read if one.report.unwrapped or not one.report.unharmed]
        unusable = self.grade == 'unusable'
        _, steps = judge(core, self.validation, read, self.verification, unusable)
        commands = 'inspect', 'diagnose', 'excite'
        named = (name for name in commands if f'armid {name}' in ''.join(steps[:1]))
        then = 'simulate' if USE in steps else next(named, '')
        bodies = []
        if core.bodies_cost is not None:
            grows = f'(torque error {100.0 * max(core.bodies_cost, 0.0):.2g} % larger)'
            bodies = [f'physically consistent links fit worse {grows}; --physical fits them']
            if core.physical is not None:
                bodies = [f'links are physically consistent {grows}; {", ".join(self.exports)}']
                bodies += core.physical.notes
        columns = joint_columns(core, self.description, held_out)
        return Summary(
            self.graded.reasons[0],
            self.grade,
            tuple(columns),
            list(zip(*columns.values(), strict=True)),
            (
                *others,
                *residual_trends(joints, held_out or core.training),
                *(self.gains.sentences() if self.gains else ()),
                *friction_per_kelvin(core.arm, estimate, core.scatter),
                *(f'{one.source}: {one.report.describe()}' for one in damaged),
                f'{count}; condition number {plain(core.condition_number)}',
                *bodies,
                *(self._parameters() if every else ()),
            ),
            steps[:1],
            then,
        )

    def _parameters(self) -> list[str]:
        """Return the lines of a table of all parameters, with estimated and described values."""
        estimate, links = self.estimate, self.arm.robot.links
        described = self.core.base.values(self.description.theta)
        rows = []
        for name, value, std, before in zip(
            estimate.parameters, estimate.values, estimate.std, described, strict=True
        ):
            number, reach = estimate_text(float(value), float(std))
            text = f'{number} ± {reach} {pretty(name.unit)}'
            rows.append((full_label(name, links), text, digits(float(before))))
        return aligned(('parameter', 'value, 95 %', 'described'), rows)


def identify(
    arm: RobotLike,
    recordings: RecordingLike | Sequence[RecordingLike],
    *,
    validate: RecordingLike | Sequence[RecordingLike] = (),
    effects: str = USUAL,
    method: Estimator = 'wls',
    cutoff: float | None = None,
    decimation: int | None = None,
    physical: bool | PhysicalSettings | None = None,
    verify: bool = False,
    payloads: Sequence[str] = (),
    rng: Rng = 0,
    progress: Progress | None = None,
) -> IdentificationResult:
    """
    Fit the rigid body and the effects of an arm to recordings.

    Parameters
    ----------
    arm : model, robot, name or path
        The model to fit; a robot without a model gets ``effects``.
    recordings : recording or path, or several
        Bags or tables with torques.
    validate : recording or path, or several
        Held-out recordings, which are predicted and not fitted.
    effects : str
        Catalogue names with commas, for a robot without a model.
    method : {'ols', 'wls', 'irls', 'iv'}
        Least squares: ordinary, weighted by the noise of each joint, or weighted and robust;
        or instrumental variables, against encoder noise.
    cutoff : float, optional
        Cut-off of the position filter [Hz]; from the noise by default.
    decimation : int, optional
        Decimation: one sample out of this many is kept.
    physical : bool or PhysicalSettings, optional
        Fit physically consistent links, which simulators need. By default such links are fitted
        if they increase the torque error by a tenth at most.
    verify : bool
        Test for encoder noise and simulate along the held-out recordings.
    payloads : sequence of str
        Known payload of each loaded recording, as 'BAG=KG@LINK[:X,Y,Z]'. The payloads determine
        the gains of the drives.
    rng : int or Generator
        Seed, or source of randomness.
    progress : callable, optional
        Called with the share of the work that is done, and the name of the present step.

    Returns
    -------
    IdentificationResult
        Prints as a table; ``plot``, ``report``, ``save``, ``to_dataframe``, ``urdf``.

    Raises
    ------
    IdentificationError
        If the data identify no parameter, or no joint moves in the held-out recordings. The
        message states the reason and the remedy.
    RecordingError
        If no recording is given, one is given twice, or one is both fitted and held out.

    Examples
    --------
    >>> import armid_ros as ar
    >>> model = ar.identify('my_arm.urdf', 'monday', validate='tuesday')
    >>> model.grade
    'good'

    """
    model = arm_of(arm, effects)
    training, held_out = with_unique_sources(
        recordings_of(recordings, model.robot, required=True),
        recordings_of(validate, model.robot),
    )
    require_once(training, held_out)
    for recording in held_out:  # a recording without motion validates no model
        resting(model.robot, recording.source, np.ptp(recording.q, axis=0))
    tick, source = progress or (lambda *_: None), np.random.default_rng(rng)
    known = PhysicalSettings() if physical is True else physical or None
    settings = IdentificationSettings(
        method, SignalSettings(cutoff, decimation), known, prefers_bodies=physical is None
    )
    gains = None
    if payloads:
        every = [*training, *held_out]
        loaded = payloads_of(payloads, every, model.robot)
        gains = drive_gains(model, training, loaded, settings.signals, source)
        training, held_out = (
            list(corrected(model, some, loaded, gains, settings.signals))
            for some in (training, held_out)
        )
    tick(0.0, 'identifying')
    result = run(model, training, settings, rng=source, progress=tick)
    validation = {recording.source: result.predict([recording]) for recording in held_out}
    found = IdentificationResult(
        result, model, tuple(training), tuple(held_out), validation, gains=gains
    )
    if verify:
        tick(1.0, 'verifying')
        verification = run_checks(result, model, training, held_out, rng=source, progress=tick)
        found = replace(found, verification=verification)
    return found
