# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Diagnosis: from recordings and a model to the effects that the model lacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, TYPE_CHECKING, TypeVar

from armid_ros.api.arguments import (
    Progress,
    RecordingLike,
    recordings_of,
    Rng,
    RobotLike,
    source_of,
    with_unique_sources,
)
from armid_ros.api.baseline import baseline_recordings, diagnosed_model
from armid_ros.api.identification import IdentificationResult
from armid_ros.api.table import data_frame, ResidualPart, ShownModel, Summary
from armid_ros.arm import ArmModel, Misfit, save_model
from armid_ros.diagnosis import diagnose as run
from armid_ros.diagnosis import (
    Diagnosis,
    diagnosis_document,
    DiagnosisSettings,
    EXPERIMENT_FILE,
    next_run,
    NextRun,
)
from armid_ros.diagnosis.diagnose import OPEN
from armid_ros.diagnosis.next_run.steps import MODEL, next_steps
from armid_ros.diagnosis.verdict.document import SCHEMA
from armid_ros.effects.tied import Partner
from armid_ros.errors import IdentificationError
from armid_ros.excitation import save_excitation
from armid_ros.files import write_file
from armid_ros.files.cells import csv_text
from armid_ros.identification import SignalSettings
from armid_ros.identification.assess.verification import ForwardValidation, simulate_held_out
from armid_ros.identification.rows.signals import conditioning
from armid_ros.recording import Recording, require_once
from armid_ros.recording.curves import draw_joints
from armid_ros.report.diagnosis_report import cause_sentences, diagnosis_report
from armid_ros.report.notation import pretty
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
from armid_ros.report.sections.diagnosed import named_rows
import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from armid_ros.residual import Residual
    import pandas

_Made = TypeVar('_Made')


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosisResult(ShownModel):
    """
    Result of a diagnosis: named effects, the model with these effects, and the evidence.

    Attributes
    ----------
    core : Diagnosis
        Everything that the diagnosis found.
    description : ArmModel
        The diagnosed model, without the named effects.
    recordings, held_out, baseline : tuple of Recording
        Recordings to diagnose, recordings only to predict, and recordings of the healthy arm.
    settings : DiagnosisSettings
        Settings of the diagnosis.
    misfit : Misfit or None
        Misfit of the model at its identification; None with a baseline, or if unknown.
    simulated : IdentificationResult or None
        Identification of a simulator's model; None without recordings of a simulator.
    residual : Residual or None
        Learned map of the unexplained residual; None if none was learned.
    forward : tuple of ForwardValidation
        Held-out recordings, simulated with the given model and with the named effects added.
    next_run : NextRun or None
        A motion that separates ambiguous names.
    no_run : str
        Why no motion separates ambiguous names; empty if there is one, or none is needed.
    notes : tuple of str
        Reasons why the residual or a simulation is missing.

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

    schema = SCHEMA
    plan_file = EXPERIMENT_FILE

    core: Diagnosis
    description: ArmModel
    recordings: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    baseline: tuple[Recording, ...] = ()
    settings: DiagnosisSettings = field(default_factory=DiagnosisSettings)
    misfit: Misfit | None = None
    simulated: IdentificationResult | None = None
    residual: Residual | None = None
    forward: tuple[ForwardValidation, ...] = ()
    next_run: NextRun | None = None
    no_run: str = ''
    notes: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """Verdict: consistent, named, ambiguous, partial, unknown, not_repeatable or bad_data."""
        return self.core.verdict

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the accepted effects, the largest first."""
        return tuple(finding.name for finding in self.core.findings)

    @property
    def arm(self) -> ArmModel:
        """Return the model with the named effects and, if learned, the map of residual torque."""
        return self.core.arm if self.residual is None else self.residual.arm

    def plot(self) -> npt.NDArray[np.object_]:
        """
        Plot the residual torque of each joint, without and with the named effects.

        Returns
        -------
        ndarray of matplotlib.axes.Axes, shape (n,)

        Raises
        ------
        IdentificationError
            If the data were refused, so that there is no residual.

        """
        shown = self.core.overlays[0]
        curves = {
            'without the named effects': (shown.trajectory.t, shown.measured - shown.before),
            'with them': (shown.trajectory.t, shown.measured - shown.after),
        }
        return draw_joints(self.arm.robot.joints, curves, 'residual torque [N m or N]')

    def _residuals(self) -> list[ResidualPart]:
        return [
            (o.trajectory.source, o.trajectory.t, o.measured - o.after) for o in self.core.overlays
        ]

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the named effects as a pandas table, one row per parameter."""
        return data_frame(
            {'effect': effect['name'], 'joints': ', '.join(effect['joints']), **row}
            for effect in self.document()['effects']
            for row in effect['parameters']
        )

    def document(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Return the content of diagnosis.json."""
        return {
            **diagnosis_document(self.core),
            'residual': None if self.residual is None else self.residual.document(),
            'forward': [pair.document() for pair in self.forward],
            'next_run': None if self.next_run is None else self.next_run.document(),
        }

    def page(self, origin: ResultOrigin = DEFAULT_ORIGIN) -> str:
        """Return the text of report.html, with verdict and evidence."""
        learned = self.residual
        return diagnosis_report(
            replace(self.core, notes=(*self.core.notes, *self.notes)),
            {
                'training': self.recordings,
                'held-out': self.held_out,
                'baseline': self.baseline,
                'simulator': self.simulated.recordings if self.simulated else (),
            },
            steps=[*self._steps(MODEL), *([] if learned is None else learned.steps())],
            everything=self.settings.everything,
            forward=self.forward,
            learned=None if learned is None else learned.section(),
            learned_joints=() if learned is None else [one.joint for one in learned.joints],
            origin=origin.of(source_of(self.description.robot)),
        )

    def fill(self, folder: Path, origin: ResultOrigin = DEFAULT_ORIGIN) -> dict[str, Any]:
        """Write diagnosis.json, model.yaml and report.html to a folder; return the document."""
        source = origin.of(source_of(self.description.robot)).source
        save_model(folder / 'model.yaml', self.arm, source, self.core.estimate, self.misfit)
        if self.residual is not None:
            write_file(folder / self.residual.table_file, csv_text(self.residual.table()))
        if self.next_run is not None:
            save_excitation(self.next_run.excitation, folder / self.plan_file)
        return super().fill(folder, origin)

    @property
    def files(self) -> list[str]:
        """Return the names of the files that `fill` writes."""
        return [
            *('diagnosis.json', 'report.html', 'model.yaml'),
            *([] if self.residual is None else [self.residual.table_file]),
            *([] if self.next_run is None else [self.plan_file]),
        ]

    def with_residual(self, seed: int) -> DiagnosisResult:
        """Return the result with a learned map of the unexplained residual, or a note why not."""
        if self.verdict not in OPEN:
            note = f'nothing is learned for the verdict {self.verdict.replace("_", " ")}'
            return replace(self, notes=(*self.notes, note))

        def learned() -> Residual | None:
            require_residual()
            from armid_ros.residual import learn_residual

            return learn_residual(self.core, np.random.default_rng(seed))

        found, why = _attempt('map', learned)
        if found is None and not why:
            why = ('nothing was learned: the residual does not depend on the state of any joint',)
        return replace(self, residual=found, notes=(*self.notes, *why))

    def with_extras(self, residual: bool, seed: int, progress: Progress) -> DiagnosisResult:
        """Add simulations of held-out data, a planned motion and, if `residual`, a torque map."""
        result = self
        if residual:
            progress(1.0, 'learning the residual')
            result = self.with_residual(seed)
        if self.held_out and self.core.gap is not None:

            def simulated() -> tuple[tuple[ForwardValidation, ...], tuple[str, ...]]:
                used = conditioning(self.recordings, self.settings.signals)
                return simulate_held_out(
                    self.description, self.arm, used, self.held_out,
                    progress=lambda _, what: progress(1.0, what),
                )  # fmt: skip

            found, why = _attempt('simulation', simulated)
            forward, left_out = found or ((), ())
            result = replace(result, forward=forward, notes=(*result.notes, *left_out, *why))
        progress(1.0, 'next run')
        rng = np.random.default_rng(seed)
        run, why = _attempt('planned trajectory for this', lambda: next_run(self.core, rng))
        return replace(result, next_run=run, no_run='; '.join(why))

    def _steps(self, model: str) -> list[str]:
        """Return the next steps for the user; `model` is the model's path in their commands."""
        worse = dict.fromkeys(joint for pair in self.forward for joint in pair.worse)
        flags = self.residual is not None, self.simulated is not None
        steps = next_steps(self.core, self.next_run, self.no_run, model, tuple(worse), *flags)
        return list(map(pretty, steps))

    def summary(self, model: str = MODEL, every: bool = True) -> Summary:
        """Return the terminal summary: verdict, significant values, notes and next steps."""
        rows: list[Sequence[str]] = [*named_rows(self.core.findings, certain=True)]
        most = 6  # number of rows without --all
        if not every and len(rows) > most + 1:
            rows[most:] = [(f'... and {len(rows) - most} more: --all, or report.html',)]
        lines = []
        if self.simulated is not None:
            sources = ', '.join(one.source for one in self.simulated.recordings)
            error = f'{self.simulated.error_percent:.2g} %'
            lines.append(f'simulator: identified from {sources} with a torque error of {error}')
        if self.baseline:
            lines.append(f'baseline: {", ".join(one.source for one in self.baseline)}')
        lines += cause_sentences(self.core)
        lines += [] if self.residual is None else self.residual.sentences()
        lines += [pair.sentence() for pair in self.forward]
        if self.verdict == 'consistent':
            lines.append('note: report.html has the detectable size of each effect')
        lines += [f'note: {note}' for note in (*self.core.notes, *self.notes)]
        if self.verdict in ('bad_data', 'not_repeatable'):
            then = 'inspect'
        elif self.verdict in OPEN and self.residual is None:
            then = 'diagnose'
        elif self.verdict == 'ambiguous' and self.next_run is None:
            then = ''  # the user has to decide between the named effects
        else:
            doubtful = self.core.doubt or self.core.harmful or self.verdict in OPEN
            then = 'identify' if doubtful else 'simulate'
        return Summary(
            pretty(self.core.summary),
            self.core.verdict.replace('_', ' '),
            ('effect', 'parameter', 'joint', 'value, 95 %') if rows else (),
            rows,
            lines,
            self._steps(model),
            then,
        )


def diagnose(
    arm: RobotLike | IdentificationResult,
    recordings: RecordingLike | Sequence[RecordingLike],
    *,
    validate: RecordingLike | Sequence[RecordingLike] = (),
    baseline: RecordingLike | Sequence[RecordingLike] | None = None,
    against: RecordingLike | Sequence[RecordingLike] = (),
    effects: str = '',
    residual: Literal['gp'] | None = None,
    cutoff: float | None = None,
    decimation: int | None = None,
    material: float = 0.01,
    everything: bool = False,
    prior: Mapping[str, str] | None = None,
    misfit: Misfit | None = None,
    partner: Partner | None = None,
    rng: Rng = 0,
    progress: Progress | None = None,
) -> DiagnosisResult:
    """
    Find the effects that a model lacks, or whose parameters have changed.

    Parameters
    ----------
    arm : identification, model, robot, name or path
        The model to diagnose. A result of ``identify`` and the path of its model.yaml supply the
        misfit of the identification, which does not count as a gap. An `ArmModel` or a robot has
        no misfit.
    recordings : recording or path, or several
        Recordings to diagnose, with torques.
    validate : recording or path, or several
        Held-out recordings, which are predicted and not fitted.
    baseline : recording or path, or several, optional
        Recordings from when the model was right. Their residual is the misfit of the model. By
        default the recordings of the identification, if they exist and none of them is
        diagnosed; ``()``: no baseline.
    against : recording or path, or several
        Recordings of a simulator. The model to diagnose is then identified from these. Their
        motion may differ from that of ``recordings``.
    effects : str
        Catalogue names with commas: effects of a robot without a model; with ``against`` the
        effects of the simulator.
    residual : {'gp'}, optional
        Learn the residual that no effect explains, if the verdict is partial or unknown.
    cutoff : float, optional
        Cut-off of the position filter [Hz]; from the noise by default.
    decimation : int, optional
        Decimation: one sample out of this many is kept.
    material : float
        Share of a joint's torque below which an effect does not matter.
    everything : bool
        Add immaterial effects to the model as well.
    prior : mapping of str to str, optional
        Frequency of effects on this arm, by name: often, usual, seldom or never.
    misfit : Misfit, optional
        Misfit of the model at its identification; by default that of ``arm``.
    partner : Partner, optional
        Second machine or person in the same recordings, which springs may tie to the arm.
    rng : int or Generator
        Seed, or source of randomness.
    progress : callable, optional
        Called with the share of the work that is done, and the name of the present step.

    Returns
    -------
    DiagnosisResult
        Prints its verdict; ``plot``, ``report``, ``save``, ``to_dataframe``, ``arm``.

    Raises
    ------
    ArmidError
        If a recording or the model cannot be used. The message names it and the remedy.

    Examples
    --------
    >>> import armid_ros as ar
    >>> model = ar.identify('my_arm.urdf', 'monday', validate='tuesday')
    >>> found = ar.diagnose(model, 'today_1', validate='today_2')
    >>> found.verdict
    'named'

    """
    if residual is not None:
        require_residual()
    arm, model, known, simulated = diagnosed_model(arm, effects, against, baseline, rng)
    robot = model.robot
    diagnosed = recordings_of(recordings, robot, required=True)
    held_out = recordings_of(validate, robot)
    before = baseline_recordings(arm, model, baseline, [*diagnosed, *held_out])
    diagnosed, held_out, before = with_unique_sources(diagnosed, held_out, before)
    require_once([*diagnosed, *before], held_out)
    misfit = misfit or known
    settings = DiagnosisSettings(
        signals=SignalSettings(cutoff, decimation),
        material=material,
        everything=everything,
        partner=partner,
        prior=prior or {},
    )
    found = DiagnosisResult(
        run(
            model,
            diagnosed,
            validate=held_out,
            baseline=before,
            misfit=misfit,
            settings=settings,
            rng=np.random.default_rng(rng),
            progress=progress,
        ),
        model,
        tuple(diagnosed),
        tuple(held_out),
        tuple(before),
        settings,
        None if before else misfit,
        simulated=simulated,
    )
    return found if residual is None else found.with_residual(rng if isinstance(rng, int) else 0)


def require_residual() -> None:
    """Raise IdentificationError if the optional packages for learning residuals are missing."""
    try:
        from armid_ros.residual import require_libraries
    except ModuleNotFoundError:
        raise IdentificationError(
            'learning a residual needs armid_ros.residual, which is missing; reinstall armid_ros'
        ) from None
    require_libraries()


def _attempt(name: str, make: Callable[[], _Made]) -> tuple[_Made | None, tuple[str, ...]]:
    """Return the result of `make()` and no note, or None and a note why `name` is missing."""
    try:
        return make(), ()
    except Exception as error:  # the diagnosis itself is valid after any error
        return None, (f'there is no {name}: {error or type(error).__name__}',)
