# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Page of a diagnosis: verdict, curves, causes, evidence, data quality."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import re
from typing import ClassVar

from armid_ros.diagnosis import Diagnosis
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.verdict.document import detectable
from armid_ros.diagnosis.verdict.finding import Gap, Overlay
from armid_ros.diagnosis.verdict.words import by_cause, names_and_places, share_interval_in_words
from armid_ros.estimate import name_in_words
from armid_ros.identification.assess.verification import ForwardValidation
from armid_ros.identification.rows.signals import conditioning, SignalSettings
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.report.arm_drawing import ArmDrawing, draw_arm
from armid_ros.report.blocks import next_steps, Paragraph, VerdictSection
from armid_ros.report.charts import Chart, joined, joined_time, Series
from armid_ros.report.notation import counted, percent, pretty, probability, robot_label, sentence
from armid_ros.report.page import Page, Section, Templated
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
from armid_ros.report.sections.data_quality import data_quality_section
from armid_ros.report.sections.diagnosed import (
    candidates_section,
    detectable_section,
    evidence_section,
    gap_bars,
    gap_section,
    minor_section,
    named_section,
    share_bars,
)
from armid_ros.report.sections.fit import forward_section, ZOOM
import numpy as np

#: Colour of each verdict; the others are bad. A named change needs attention.
_TONES = {'consistent': 'good', 'named': 'fair', 'ambiguous': 'fair', 'partial': 'fair'}


def tone_of(diagnosis: Diagnosis) -> str:
    """Return the colour of a verdict: 'good' only if it is certain and all joints were checked."""
    tone = _TONES.get(diagnosis.verdict, 'bad')
    return 'fair' if tone == 'good' and (diagnosis.not_checked or diagnosis.doubt) else tone


def cause_sentences(diagnosis: Diagnosis) -> list[str]:
    """Return sentences on the share that each cause explains, and on minor effects."""
    shares = [
        f'{names_and_places(group)}: {percent(group[0].share)} of the difference'
        f'{share_interval_in_words(group[0])}{", together" * (len(group) > 1)}'
        for group in by_cause(diagnosis.findings)
    ]
    minor = [
        'minor (significant, but negligible or not confirmed): '
        f'{name_in_words(one.name)} in {", ".join(one.joints) or "the whole arm"}, '
        f'p {probability(one.p)}'
        for one in diagnosis.minor
    ]
    return [*shares, *minor]


#: Use of a recording, its noun, and the phrase for a number of such recordings.
_ROLES = (
    ('training', 'recording', '{}'),
    ('held-out', 'recording', '{} not used for the fit'),
    ('baseline', 'recording', '{} from before'),
    ('simulator', 'recording', '{} of a simulator'),
)


def diagnosis_report(
    diagnosis: Diagnosis,
    read: Mapping[str, Sequence[Recording]],
    *,
    steps: Sequence[str] = (),
    everything: bool = False,
    forward: Sequence[ForwardValidation] = (),
    learned: Section | None = None,
    learned_joints: Sequence[str] = (),
    origin: ResultOrigin = DEFAULT_ORIGIN,
) -> str:
    """
    Return the HTML page of a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    read : mapping of str to sequence of Recording
        Recordings by their use: 'training', 'held-out', 'baseline', 'simulator'.
    steps : sequence of str
        Next steps, the first one for the verdict box.
    everything : bool
        Whether negligible effects were added to the model.
    forward : sequence of ForwardValidation
        Held-out recordings simulated with the given and with the patched model.
    learned : Section, optional
        Section on the learned residual.
    learned_joints : sequence of str
        Joints with a learned residual.
    origin : ResultOrigin
        Robot, files, versions, settings, seed.

    """
    arm = diagnosis.arm
    recordings = [(one, role) for role, several in read.items() for one in several]
    worse = tuple(dict.fromkeys(joint for pair in forward for joint in pair.worse))
    verdict = _verdict(diagnosis, worse, ''.join(steps[:1]))
    sections = []
    curves = whole_overlays(diagnosis, [one for one, _ in recordings])
    if curves is not None and diagnosis.gap is not None:
        story = Story(diagnosis, learned_joints)
        sections += [overlay_section(diagnosis, curves), Section('Arm and model', [story])]
        if diagnosis.findings:
            sections += [gap_section(diagnosis, diagnosis.gap), named_section(diagnosis.findings)]
        if diagnosis.where:
            sections.append(evidence_section(diagnosis))
    if learned is not None:
        sections.append(learned)
    sections += next_steps(steps)
    if diagnosis.minor:
        sections.append(minor_section(diagnosis, everything))
    if diagnosis.gap is not None:
        sizes = detectable(diagnosis.explanation)
        sections += [candidates_section(diagnosis), detectable_section(sizes)]
    if forward:
        labels = ('given model', 'patched model')
        sections.append(forward_section(arm.robot, forward, labels))
    quality = [(one, role, ()) for one, role in recordings]
    sections.append(data_quality_section(quality, at_fault=_at_fault(diagnosis, read)))
    used = [
        kind.format(counted(len(read[role]), noun))
        for role, noun, kind in _ROLES
        if read.get(role)
    ]
    subtitle = ' · '.join([robot_label(origin.robot), *used])
    names = (*arm.robot.joints, *arm.robot.links)
    title = f'Diagnosis of {arm.robot.name}'
    return Page(title, subtitle, verdict, sections, origin.provenance, names).html()


def _at_fault(diagnosis: Diagnosis, read: Mapping[str, Sequence[Recording]]) -> list[str]:
    """Return the recordings with bad data by the verdict; [] for verdicts other than bad_data."""
    if diagnosis.verdict != 'bad_data':
        return []
    sources = [one.source for several in read.values() for one in several if one.source]
    name = r'(?<![\w/]){}(?![\w/])'
    named = [x for x in sources if re.search(name.format(re.escape(x)), diagnosis.summary)]
    return named or [one.source for one in read['training']]


def _verdict(diagnosis: Diagnosis, worse: Sequence[str], step: str) -> VerdictSection:
    """Return the verdict box: causes, next step, and bars of explained shares or errors."""
    notes = [sentence(note) for note in diagnosis.notes]
    if worse:
        notes.append(
            'Driven by the recorded torques, the patched model has larger position errors than '
            f'the given model in {", ".join(worse)}; see Forward validation.'
        )
    first, stop, more = pretty(diagnosis.summary).partition('. ')
    badge = {'named': 'cause named'}.get(diagnosis.verdict, diagnosis.verdict.replace('_', ' '))
    bars = None
    if diagnosis.gap is not None and diagnosis.verdict not in ('bad_data', 'not_repeatable'):
        bars = share_bars(diagnosis) if diagnosis.findings else gap_bars(diagnosis, diagnosis.gap)
    sentences = [first + stop.rstrip(), *filter(None, [more])]
    return VerdictSection(badge, tone_of(diagnosis), sentences, notes, bars, step)


@dataclass(frozen=True)
class Story(Templated):
    """
    Drawing of the arm, and facts on the causes and on the model with the named effects.

    Attributes
    ----------
    diagnosis : Diagnosis
        The diagnosis.
    learned : sequence of str
        Joints with a learned residual.

    """

    template: ClassVar[str] = 'story.html'

    diagnosis: Diagnosis
    learned: Sequence[str] = ()

    @property
    def drawing(self) -> ArmDrawing:
        """Drawing of the arm in a recorded pose; joints with a cause are coloured."""
        data, robot = self.diagnosis.data, self.diagnosis.arm.robot
        causes = self.diagnosis.findings
        largest = [place.joint for place in self.diagnosis.where[:1]]
        if self.diagnosis.gap is not None and self.diagnosis.verdict == 'not_repeatable':
            largest = [robot.joints[_worst(self.diagnosis, self.diagnosis.gap)]]
        named = {joint for one in causes for joint in one.joints or robot.joints}
        joints = [joint for joint in robot.all_joints if joint in named] if causes else largest
        places = [
            f'{", ".join(one.joints) or "the whole arm"} ({name_in_words(one.name)})'
            for one in causes
        ]
        places = places or [f'{joint} (the largest error)' for joint in largest]
        caption = f'coloured: {", ".join(places)}'
        q = np.concatenate([part.at_rows.q for part in data]) if data else None
        return draw_arm(robot, joints, q, caption if joints else 'no joint stands out')

    @property
    def rows(self) -> list[tuple[str, list[str]]]:
        """Names and values of facts, such as times of the causes and meaning of the effects."""
        diagnosis, patched = self.diagnosis, not self.diagnosis.harmful
        meaning = {effect.name: effect.summary for effect in diagnosis.arm.effects}
        names = list(dict.fromkeys(one.name for one in diagnosis.findings if patched))
        added = [name_in_words(name) for name in names]
        if self.learned:
            added.append(f'the learned residual of {", ".join(self.learned)}')
        more = ', with rigid body and friction refitted' * (diagnosis.refitted and patched)
        patch = f'model.yaml is the given model with {" and ".join(added)}{more}.'
        unexplained = [f'{w.joint}: {w.signature}' for w in diagnosis.left[:2]]
        answers = [
            (
                'When',
                [
                    f'{one.source} from {one.start:.1f} to {one.stop:.1f} s'
                    for one in diagnosis.spans
                ],
            ),
            ('Model', [patch if added else 'The model is unchanged.']),
            *(
                (words[:1].upper() + words[1:], [f'{meaning[name]}.'])
                for name, words in zip(names, added, strict=False)
                if name in meaning
            ),
            ('Unexplained', unexplained if diagnosis.findings else []),
            ('Not checked', list(diagnosis.not_checked)),
        ]
        return [(question, answer) for question, answer in answers if answer]


def overlay_section(diagnosis: Diagnosis, gap: Gap) -> Section:
    """
    Return the section with measured and modelled torques of the worst joint.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis, with the time spans of the causes.
    gap : Gap
        Torques, measured and modelled.

    """
    robot, patched = diagnosis.arm.robot, bool(diagnosis.findings)
    j = _worst(diagnosis, gap)

    def size(overlay: Overlay) -> float:
        residual = (overlay.measured - overlay.before)[:, j] / overlay.sigma[j]
        return float(np.mean(residual**2))

    shown = max(gap.overlays, key=size)
    t, measured, before, after = _of_recording(gap, shown, j)
    unit = robot.torque_units[j]
    acting = [
        one for one in diagnosis.spans if one.source == shown.trajectory.source and not one.whole
    ]
    marks = [(one.start, f'from {one.start:.1f} s', True) for one in acting]
    marks += [(one.stop, f'to {one.stop:.1f} s', False) for one in acting]
    band: FloatArray = np.full(len(t), 2.0 * shown.sigma[j])
    torques, residuals = (
        [
            *([Series('given model', given, 'before')] if patched else []),
            Series('with the named cause' if patched else 'model', last, 'after'),
        ]
        for given, last in ((before, after), (measured - before, measured - after))
    )
    dashes = ', dashes on it are the model with the named cause' * patched
    return Section(
        'Measured and modelled',
        [
            Paragraph(
                f'Joint with the largest error: {robot.joints[j]}, in recording '
                f'{shown.trajectory.source}.'
            ),
            Chart.over_time(
                t,
                [Series('measured', measured, 'measured'), *torques],
                f'torque [{unit}]',
                link='overlay',
                marks=marks,
            ),
            Chart.over_time(
                t,
                [
                    Series('twice the usual error', -band, 'floor', 'band', band),
                    *residuals,
                ],
                f'residual [{unit}]',
                height=170,
                link='overlay',
                marks=marks,
                symmetric=True,
            ),
            Paragraph(
                f'The broad line is the measured torque{dashes}. {ZOOM} Errors do not count where '
                'the joint reverses, because friction is undetermined there.',
                'hint',
            ),
        ],
    )


def _worst(diagnosis: Diagnosis, gap: Gap) -> int:
    """Return the index of the joint with the largest gap, or of a joint that does not repeat."""
    if diagnosis.verdict != 'not_repeatable':
        return int(np.argmax(gap.chi2_before))
    # the floor contains the part of the torque that does not repeat
    return diagnosis.arm.robot.joints.index(diagnosis.not_repeating[0])


def _of_recording(gap: Gap, shown: Overlay, joint: int) -> tuple[FloatArray, ...]:
    """Return the times of a recording, and the measured and modelled torques of one joint."""
    here = shown.trajectory.source, shown.trajectory.fold
    parts = [(one, one.trajectory) for one in gap.overlays]
    own = [one for one, part in parts if (part.source, part.fold) == here]
    curves = zip(*((one.measured, one.before, one.after) for one in own), strict=True)
    t = joined_time([one.trajectory.t for one in own])
    return t, *(joined([part[:, joint] for part in parts]) for parts in curves)


def whole_overlays(diagnosis: Diagnosis, recordings: Sequence[Recording]) -> Gap | None:
    """
    Return the gap with torque curves, which show whole recordings if a cause acts temporarily.

    Parameters
    ----------
    diagnosis : Diagnosis
        The diagnosis; outside of its spans, the patched model is replaced by the given model.
    recordings : sequence of Recording
        All recordings.

    """
    gap, explanation = diagnosis.gap, diagnosis.explanation
    if gap is None or explanation is None or not diagnosis.spans:
        return gap
    firsts, overlays = {one.trajectory.source: one for one in reversed(gap.overlays)}, []
    for span in diagnosis.spans:
        first, read = firsts.get(span.source), [r for r in recordings if r.source == span.source]
        if first is None or not read:
            continue
        settings = SignalSettings(cutoff_hz=first.trajectory.used.cutoff_hz)
        for part in trajectories(read, conditioning(read, settings)):
            arms = explanation.reference.arm, explanation.fitted.arm
            before, after = (part.torque - part.residual(arm) for arm in arms)
            acts = (part.t >= span.start) & (part.t <= span.stop)
            after = np.where(acts[:, np.newaxis], after, before)
            overlays.append(Overlay(part, part.torque, before, after, first.sigma))
    return replace(gap, overlays=tuple(overlays) or gap.overlays)
