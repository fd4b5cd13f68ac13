# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recordings and a model in, what the model lacks out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any, Literal, TYPE_CHECKING, TypeGuard

from armid_ros.api.arguments import (
    arm_of,
    generator,
    is_model,
    RecordingLike,
    recordings_of,
    Rng,
    RobotLike,
    some_recordings_of,
    source_of,
    with_sources_apart,
)
from armid_ros.api.identification import IdentificationResult
from armid_ros.api.table import Shown, Summary
from armid_ros.arm import ArmModel, Misfit, save_model
from armid_ros.arm.export import arm_urdf
from armid_ros.diagnosis import diagnose as run
from armid_ros.diagnosis import Diagnosis, diagnosis_document, DiagnosisSettings
from armid_ros.files import staged, write_file
from armid_ros.identification import SignalSettings
from armid_ros.identification.identified_from import identified_from, require_as_identified
from armid_ros.identification.parameters_file import read_misfit
from armid_ros.recording import Recording, require_once
from armid_ros.report.notation import value_of
from armid_ros.residual import (
    learn_residual,
    lookup_table,
    require_libraries,
    Residual,
    TABLE_FILE,
)
from armid_ros.simulation.bodies import require_any_mass
import numpy as np

if TYPE_CHECKING:
    from armid_ros.report.page import Section
    import pandas


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosisResult(Shown):
    """
    What a model lacks.

    Attributes
    ----------
    core : Diagnosis
        Everything that the diagnosis found.
    description : ArmModel
        The model before.
    recordings, held_out : tuple of Recording
        What was looked at, and what was only predicted.
    residual : Residual or None
        What is left without a name, learned, where that was asked for.

    Examples
    --------
    >>> import armid_ros as ar
    >>> arm = ar.load_model('monday_result/model.yaml')
    >>> found = ar.diagnose(arm, 'today_1', validate='today_2', baseline='monday')
    >>> found.verdict, found.names
    ('named', ('joint_spring',))
    >>> found.arm.effects[-1].joints  # the model with the spring added
    ('elbow',)

    """

    core: Diagnosis
    description: ArmModel
    recordings: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    residual: Residual | None = None

    @property
    def verdict(self) -> str:
        """One word: consistent, named, ambiguous, partial, unknown, not_repeatable, bad_data."""
        return self.core.verdict

    @property
    def summary_text(self) -> str:
        """Return the verdict in a sentence or two."""
        return self.core.summary

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that are named, the largest first."""
        return tuple(finding.name for finding in self.core.findings)

    @property
    def arm(self) -> ArmModel:
        """Return the model with what was found added, and with what was learned."""
        return self.core.arm if self.residual is None else self.residual.arm

    def urdf(self, path: str | Path | None = None) -> str:
        """Return the description with what was found; write it where a path is given."""
        text = arm_urdf(self.arm).text
        if path is not None:
            write_file(path, text)
        return text

    def to_dataframe(self) -> pandas.DataFrame:
        """Return what was named as a pandas table, a row a parameter."""
        from pandas import DataFrame

        return DataFrame(
            {'effect': effect['name'], 'joints': ', '.join(effect['joints']), **row}
            for effect in self.document()['effects']
            for row in effect['parameters']
        )

    def document(self) -> dict[str, Any]:
        """Return what diagnosis.json holds."""
        learned = None if self.residual is None else self.residual.document(TABLE_FILE)
        return {**diagnosis_document(self.core), 'residual': learned}

    def report(self, path: str | Path = 'report.html') -> Path:
        """Write the page with the verdict and the evidence; return where it is."""
        from armid_ros.report.diagnosis_report import DiagnosedRecordings, diagnosis_report, Extras

        page = diagnosis_report(
            self.core,
            DiagnosedRecordings(self.recordings, self.held_out),
            robot=self._robot,
            extras=Extras(residual=self.residual),
        )
        write_file(Path(path), page)
        return Path(path)

    def save(self, folder: str | Path) -> Path:
        """Write diagnosis.json, model.yaml and report.html as ``armid diagnose`` does."""
        with staged(Path(folder)) as result:
            part = result.folder
            write_file(part / 'diagnosis.json', json.dumps(self.document(), indent=1))
            save_model(part / 'model.yaml', self.arm, self._robot, self.core.estimate)
            if self.residual is not None:
                write_file(part / TABLE_FILE, lookup_table(self.residual))
            self.report(part / 'report.html')
            result.keep()
        return result.out

    def summary(self) -> Summary:
        """Return what was named, with values."""
        rows = []
        for finding in self.core.findings:
            for parameter, value, std in zip(
                finding.parameters, finding.values, finding.std, strict=True
            ):
                said = value_of(finding, parameter, value, std)
                where = finding.place_of(parameter.joint) or 'whole arm'
                rows.append((finding.name, where, parameter.name, said))
        below = [] if self.residual is None else list(self.residual.sentences())
        return Summary(
            self.core.summary.replace('+-', '±'),
            self.core.verdict.replace('_', ' '),
            ('effect', 'joint', 'parameter', 'value, 95 %') if rows else (),
            rows,
            lines=below,
        )

    def tone(self) -> str:
        """Return the colour of the verdict."""
        from armid_ros.report.diagnosis_report import tone_of

        return tone_of(self.core)

    def sections(self) -> list[Section]:
        """Return the gap of every joint, before and after."""
        from armid_ros.report.sections.gap import GapBars

        gap, robot = self.core.gap, self.description.robot
        if gap is None:
            return []
        return [GapBars(robot, gap, self.core.baseline, bool(self.core.findings))]

    @property
    def _robot(self) -> str:
        return source_of(self.description.robot)


def diagnose(
    arm: RobotLike | IdentificationResult,
    recordings: RecordingLike | Sequence[RecordingLike],
    *,
    validate: RecordingLike | Sequence[RecordingLike] = (),
    baseline: RecordingLike | Sequence[RecordingLike] | None = None,
    effects: str = '',
    residual: Literal['gp'] | None = None,
    cutoff: float | None = None,
    decimation: int | None = None,
    rng: Rng = 0,
) -> DiagnosisResult:
    """
    Find what a model lacks.

    Parameters
    ----------
    arm : identification, model, robot, name or path
        What is believed of the arm. Of what ``identify`` returned, and of the path of the
        model.yaml that it wrote, it is known what the model left then, which is no gap. An
        `ArmModel` is believed as it is.
    recordings : recording or path, or several
        What it did.
    validate : recording or path, or several
        To be predicted and not to be fitted.
    baseline : recording or path, or several, optional
        From when the model was right: what it left then is no cause. By default what it was
        identified from, where that is known and there, and is not looked at; ``()`` asks
        without.
    effects : str
        Catalogue names with commas, for a robot without a model.
    residual : {'gp'}, optional
        Learn what is left without a name, where the verdict is partial or unknown.
    cutoff : float, optional
        Of the position filter [Hz]; from the noise by default.
    decimation : int, optional
        Keep one sample of this many.
    rng : int or Generator
        Seed, or source of randomness.

    Returns
    -------
    DiagnosisResult
        Prints its verdict; ``report``, ``save``, ``to_dataframe``, ``arm``.

    Raises
    ------
    ArmidError
        A recording or the model cannot be used; the message names it and what to do.

    Examples
    --------
    >>> import armid_ros as ar
    >>> model = ar.identify('my_arm.urdf', 'monday', validate='tuesday')
    >>> found = ar.diagnose(model, 'today_1', validate='today_2')
    >>> found.verdict
    'named'

    """
    if residual is not None:
        require_libraries()
    model = arm.arm if isinstance(arm, IdentificationResult) else arm_of(arm, effects)
    require_any_mass(model.robot)
    looked_at = some_recordings_of(recordings, model.robot)
    held_out = recordings_of(validate, model.robot)
    if baseline is None:
        before = _since(arm, model, [*looked_at, *held_out])
    else:
        before = recordings_of(baseline, model.robot)
    looked_at, held_out, before = with_sources_apart(looked_at, held_out, before)
    require_once([*looked_at, *before], held_out)
    result = run(
        model,
        looked_at,
        validate=held_out,
        baseline=before,
        misfit=_misfit(arm, model),
        settings=DiagnosisSettings(signals=SignalSettings(cutoff, decimation)),
        rng=generator(rng),
    )
    learned = None if residual is None else learn_residual(result, generator(rng))
    return DiagnosisResult(result, model, tuple(looked_at), tuple(held_out), learned)


def _misfit(arm: RobotLike | IdentificationResult, model: ArmModel) -> Misfit | None:
    """Return what a model left when it was identified, where that is known."""
    if isinstance(arm, IdentificationResult):
        return arm.misfit
    return read_misfit(arm, model) if _is_written(arm) else None


def _since(
    arm: RobotLike | IdentificationResult, model: ArmModel, asked: Sequence[Recording]
) -> list[Recording]:
    """Return what a model was identified from; nothing if some of it is looked at."""
    if isinstance(arm, IdentificationResult):
        found = [*arm.recordings, *arm.held_out]
    elif _is_written(arm):
        found = recordings_of(identified_from(arm), model.robot)
    else:
        return []
    if any(_same(one, other) for one in found for other in asked):
        return []
    if not isinstance(arm, IdentificationResult):
        require_as_identified(arm)
    return found


def _same(one: Recording, other: Recording) -> bool:
    return bool(np.array_equal(one.t, other.t) and np.array_equal(one.q, other.q))


def _is_written(arm: RobotLike) -> TypeGuard[str | Path]:
    return isinstance(arm, (str, Path)) and is_model(arm)
