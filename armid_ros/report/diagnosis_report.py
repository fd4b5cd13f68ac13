# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a diagnosis: the story first, then the evidence, then what was looked at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from armid_ros.diagnosis import Diagnosis, DiagnosisSettings, NextRun
from armid_ros.diagnosis.next_run.steps import MODEL, next_steps
from armid_ros.diagnosis.verdict.document import detectable
from armid_ros.identification.assess.verification import ForwardValidation
from armid_ros.recording import Recording
from armid_ros.report.notation import counted, robot_label
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.candidates import CandidateTable
from armid_ros.report.sections.data_quality import DataQuality, RecordingQuality
from armid_ros.report.sections.diagnosed import (
    CouldBeSeen,
    EvidenceSection,
    NamedParameters,
    PatchSection,
    Shares,
    SmallPrint,
)
from armid_ros.report.sections.forward import Forward
from armid_ros.report.sections.frame import NextSteps, Origin, VerdictSection
from armid_ros.report.sections.gap import GapBars, GapOverlay
from armid_ros.report.sections.residual_map import ResidualMap
from armid_ros.report.sections.story import share_of, Story
from armid_ros.report.sources import short_names, with_names
from armid_ros.residual import Residual

#: Colour of each verdict; the others are bad.
_TONES = {'consistent': 'good', 'named': 'good', 'ambiguous': 'fair', 'partial': 'fair'}


def tone_of(diagnosis: Diagnosis, worse: Sequence[str] = ()) -> str:
    """
    Return the colour of a verdict.

    None is good if the model is doubted, or not patched with what was named, if a cause is
    suspected, a joint not checked, or a simulation got worse in some joints.

    """
    tone = _TONES.get(diagnosis.verdict, 'bad')
    open_ends = diagnosis.not_checked, diagnosis.doubt, diagnosis.suspected, diagnosis.harmful
    return 'fair' if tone == 'good' and (any(open_ends) or worse) else tone


@dataclass(frozen=True)
class DiagnosedRecordings:
    """
    Recordings of a diagnosis.

    Attributes
    ----------
    recordings : sequence of Recording
        Data that were looked at.
    held_out : sequence of Recording
        Data that were only predicted.
    baseline : sequence of Recording
        Data from before.

    """

    recordings: Sequence[Recording] = ()
    held_out: Sequence[Recording] = ()
    baseline: Sequence[Recording] = ()


@dataclass(frozen=True)
class Extras:
    """
    What was made of a diagnosis.

    Attributes
    ----------
    forward : tuple of ForwardValidation
        Held-out recordings simulated, with the model as it was and as it is patched.
    next_run : NextRun or None
        A motion that separates names in doubt.
    no_run : str
        Why there is no next run, where names are in doubt.
    notes : tuple of str
        Why there is not more.
    residual : Residual or None
        What is left without a name, learned.

    """

    forward: tuple[ForwardValidation, ...] = ()
    next_run: NextRun | None = None
    no_run: str = ''
    notes: tuple[str, ...] = ()
    residual: Residual | None = None

    def steps(self, diagnosis: Diagnosis, model: str = MODEL) -> list[str]:
        """Return what to do next, for the page and the terminal, and where the model is."""
        return next_steps(diagnosis, self.next_run, self.no_run, model, self.worse)

    @property
    def worse(self) -> tuple[str, ...]:
        """Joints that a simulation with the patched model is farther off in than before."""
        return tuple(dict.fromkeys(joint for pair in self.forward for joint in pair.worse))


def diagnosis_report(
    diagnosis: Diagnosis,
    data: DiagnosedRecordings,
    *,
    robot: str,
    settings: DiagnosisSettings | None = None,
    extras: Extras | None = None,
    patch: str = '',
    provenance: Provenance | None = None,
) -> str:
    """
    Return report.html of a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.
    data : DiagnosedRecordings
        Where it was found.
    robot : str
        Shipped name or path of the description.
    settings : DiagnosisSettings, optional
        What was asked.
    extras : Extras, optional
        What was made of it.
    patch : str
        model.yaml of the patched model.
    provenance : Provenance, optional
        Files, versions, settings, seed.

    Returns
    -------
    str
        One HTML file that loads nothing.

    """
    settings, extras = settings or DiagnosisSettings(), extras or Extras()
    read = {'training': data.recordings, 'held-out': data.held_out, 'baseline': data.baseline}
    names = short_names([one.source for every in read.values() for one in every])
    sections: list[Section] = [
        _verdict(diagnosis, names, extras.worse),
        *_story(diagnosis, names, extras.residual),
        *([] if extras.residual is None else [ResidualMap(extras.residual)]),
        NextSteps([*map(_printed, extras.steps(diagnosis)), *_of_maps(extras.residual)]),
        *_small_print(diagnosis, settings),
    ]
    if extras.forward:
        pairs = [_renamed(pair, names) for pair in extras.forward]
        sections.append(Forward(diagnosis.arm.robot, pairs, ('as it was', 'patched')))
    quality = [_quality(r, role, names) for role, every in read.items() for r in every]
    sections.append(DataQuality(quality, at_fault=_at_fault(diagnosis, data, names)))
    if diagnosis.findings and not diagnosis.harmful:
        sections.append(PatchSection(diagnosis.findings, patch))
    sections.append(Origin(provenance or Provenance()))
    subtitle = (
        f'{robot_label(robot)} · {counted(len(data.recordings), "recording")} · '
        f'{counted(len(data.held_out), "held-out recording")}'
    )
    if data.baseline:
        subtitle += f' · {counted(len(data.baseline), "recording")} from before'
    return Page(f'Diagnosis of {diagnosis.arm.robot.name}', subtitle, sections).html()


def _at_fault(
    diagnosis: Diagnosis, data: DiagnosedRecordings, names: Mapping[str, str]
) -> list[str]:
    """Return the recordings that a verdict of bad data names, or all that were asked about."""
    if diagnosis.verdict != 'bad_data':
        return []
    read = [*data.recordings, *data.held_out, *data.baseline]
    said = [one.source for one in read if one.source and one.source in diagnosis.summary]
    sources = said or [one.source for one in data.recordings]
    return [names.get(source, source) or 'in memory' for source in sources]


def _verdict(
    diagnosis: Diagnosis, names: Mapping[str, str], worse: Sequence[str]
) -> VerdictSection:
    tone = tone_of(diagnosis, worse)
    notes = [with_names(note, names) for note in diagnosis.notes]
    if worse:
        notes.append(
            f'Driven by the recorded torques, the patched model has larger position errors than '
            f'before in {", ".join(worse)}; see Forward validation.'
        )
    summary = _printed(with_names(diagnosis.summary, names))
    badge = 'cause found' if diagnosis.verdict == 'named' else diagnosis.verdict.replace('_', ' ')
    return VerdictSection(badge, tone, [summary], notes)


def _printed(text: str) -> str:
    """Return a sentence of the terminal as it is printed."""
    return text.replace('+-', '±')


def _story(
    diagnosis: Diagnosis, names: Mapping[str, str], residual: Residual | None
) -> list[Section]:
    """Return what a person wants to know: where, which, how much, and the curves that show it."""
    if diagnosis.gap is None:
        return []
    robot, patched = diagnosis.arm.robot, bool(diagnosis.findings)
    sections: list[Section] = [Story(diagnosis, residual)]
    if patched:
        sections.append(Shares(diagnosis))
    sections += [
        GapOverlay(robot, diagnosis.gap, patched, names),
        GapBars(robot, diagnosis.gap, diagnosis.baseline, patched, diagnosis.harmful),
    ]
    if patched:
        sections.append(NamedParameters(diagnosis.findings))
    if diagnosis.where:
        sections.append(EvidenceSection(diagnosis.where, share_of(diagnosis)))
    return sections


def _small_print(diagnosis: Diagnosis, settings: DiagnosisSettings) -> list[Section]:
    """Return what else was looked at."""
    sections: list[Section] = []
    if diagnosis.minor:
        sections.append(SmallPrint(diagnosis.minor, settings.everything, bool(diagnosis.findings)))
    if diagnosis.gap is not None:
        sizes = detectable(diagnosis.explanation)
        sections += [CandidateTable(diagnosis), CouldBeSeen(sizes)]
    return sections


def _quality(recording: Recording, role: str, names: Mapping[str, str]) -> RecordingQuality:
    found = RecordingQuality.of(recording, role)
    return replace(
        found,
        source=names.get(found.source, found.source),
        description=with_names(found.description, names),
    )


def _renamed(pair: ForwardValidation, names: Mapping[str, str]) -> ForwardValidation:
    after = replace(pair.after, source=names.get(pair.after.source, pair.after.source))
    return replace(pair, after=after)


def _of_maps(residual: Residual | None) -> list[str]:
    steps = []
    for one in () if residual is None else residual.joints:
        if one.law is None:
            steps.append(f'Inspect gear, cables and stops of {one.joint} where its map is strong.')
        else:
            steps.append(
                f'If {one.law.text} is plausible for {one.joint}, write it as an effect of your '
                'own and diagnose again.'
            )
    return steps
