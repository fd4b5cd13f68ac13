# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a diagnosis: the verdict first, then the evidence, then what to do."""

from __future__ import annotations

from collections.abc import Sequence

from armid_ros.diagnosis import Diagnosis, NextRun
from armid_ros.diagnosis.verdict.detectable import detectable
from armid_ros.identification.verification import ForwardValidation
from armid_ros.recording import Recording
from armid_ros.report.notation import counted
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import Provenance
from armid_ros.report.sections.candidates import CandidateTable
from armid_ros.report.sections.could_be_seen import CouldBeSeen
from armid_ros.report.sections.data_quality import DataQuality, RecordingQuality
from armid_ros.report.sections.evidence import Evidence
from armid_ros.report.sections.forward import Forward
from armid_ros.report.sections.gap import GapBars, GapOverlay
from armid_ros.report.sections.named import NamedParameters
from armid_ros.report.sections.next_steps import NextSteps
from armid_ros.report.sections.origin import Origin
from armid_ros.report.sections.patch import Patch
from armid_ros.report.sections.staircase import Staircase
from armid_ros.report.sections.verdict import Verdict

_TONES = {'consistent': 'good', 'named': 'good', 'ambiguous': 'fair', 'partial': 'fair'}


def diagnosis_report(
    diagnosis: Diagnosis,
    *,
    robot: str,
    recordings: Sequence[Recording],
    validation: Sequence[Recording] = (),
    forward: Sequence[ForwardValidation] = (),
    next_run: NextRun | None = None,
    patch: str = '',
    provenance: Provenance | None = None,
) -> str:
    """
    Return report.html of a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.
    robot : str
        Shipped name or path of the description.
    recordings : sequence of Recording
        Data that were looked at.
    validation : sequence of Recording
        Data that were only predicted.
    forward : sequence of ForwardValidation
        Those data simulated, with the model as it was and as it is patched.
    next_run : NextRun, optional
        The motion that was written to separate names.
    patch : str
        model.yaml of the patched model.
    provenance : Provenance, optional
        Files, versions, settings, seed.

    Returns
    -------
    str
        One HTML file that loads nothing.

    """
    word = diagnosis.verdict.replace('_', ' ')
    sections: list[Section] = [
        Verdict(
            word, _TONES.get(diagnosis.verdict, 'bad'), [diagnosis.summary], list(diagnosis.notes)
        )
    ]
    if diagnosis.gap is not None:
        joints = diagnosis.arm.robot
        sections += [
            GapBars(joints, diagnosis.gap),
            GapOverlay(joints, diagnosis.gap),
        ]
        if diagnosis.where:
            sections.append(Evidence(diagnosis.where))
        sections += [CandidateTable(diagnosis), Staircase(diagnosis)]
        sections.append(CouldBeSeen(detectable(diagnosis.explanation, diagnosis.arm.robot)))
    sections.append(NextSteps(_next_steps(diagnosis, next_run)))
    if diagnosis.findings:
        sections.append(NamedParameters(diagnosis.findings))
    if forward:
        sections.append(Forward(diagnosis.arm.robot, forward, ('as it was', 'patched')))
    sections.append(
        DataQuality(
            [
                *(RecordingQuality.of(recording, 'training') for recording in recordings),
                *(RecordingQuality.of(recording, 'held-out') for recording in validation),
            ]
        )
    )
    if diagnosis.findings:
        sections.append(Patch(diagnosis.findings, patch))
    sections.append(Origin(provenance or Provenance()))
    subtitle = (
        f'{robot} · {counted(len(recordings), "recording")} · '
        f'{counted(len(validation), "held-out recording")}'
    )
    return Page(f'Diagnosis of {diagnosis.arm.robot.name}', subtitle, sections).html()


def _next_steps(diagnosis: Diagnosis, next_run: NextRun | None) -> list[str]:
    steps = [] if next_run is None else [next_run.sentence]
    steps += [finding.experiment for finding in diagnosis.findings if finding.experiment]
    if diagnosis.verdict == 'bad_data':
        steps.append('Correct the data, or the description, and diagnose again.')
    if diagnosis.verdict in ('unknown', 'partial'):
        steps += [f'Look at {w.joint}: what is left lives {w.signature}.' for w in diagnosis.left]
    if diagnosis.verdict == 'not_repeatable':
        steps.append('Keep people and loose parts away from the arm, and record again.')
    if diagnosis.verdict in ('named', 'consistent'):
        steps.append('Use model.yaml in simulation and control; keep these bags to compare with.')
    if diagnosis.not_visible:
        hidden = ', '.join(name.replace('_', ' ') for name in diagnosis.not_visible)
        steps.append(f'These data cannot show: {hidden}. Other motions, or known values, can.')
    return steps
