# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a diagnosis: the story first, then the evidence, then the data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import re
from typing import ClassVar, TYPE_CHECKING

from armid_ros.diagnosis import Diagnosis, Finding, NextRun
from armid_ros.diagnosis.next_run.steps import MODEL, next_steps
from armid_ros.diagnosis.verdict.document import detectable
from armid_ros.diagnosis.verdict.words import by_cause, names_and_places, share_in_words
from armid_ros.estimate import name_in_words
from armid_ros.identification.assess.verification import ForwardValidation
from armid_ros.recording import Recording
from armid_ros.report.arm_drawing import ArmDrawing, draw_arm
from armid_ros.report.blocks import next_steps_section, Origin, VerdictSection
from armid_ros.report.notation import (
    counted,
    digits,
    percent,
    pretty,
    probability,
    robot_label,
    short_names,
    with_names,
)
from armid_ros.report.page import Page, Section
from armid_ros.report.provenance import DEFAULT_ORIGIN, ResultOrigin
from armid_ros.report.sections.data_quality import data_quality_section
from armid_ros.report.sections.diagnosed import (
    candidates_section,
    detectable_section,
    evidence_section,
    gap_section,
    minor_section,
    named_section,
    patch_section,
    share_bars,
    share_of,
)
from armid_ros.report.sections.fit import forward_section
from armid_ros.report.sections.overlay import overlay_section, whole_overlays
import numpy as np

if TYPE_CHECKING:
    from armid_ros.residual import Residual

#: Colour of each verdict; the others are bad.
_TONES = {'consistent': 'good', 'named': 'good', 'ambiguous': 'fair', 'partial': 'fair'}
#: Joints of the gap that are listed one by one.
_JOINTS = 2


def tone_of(diagnosis: Diagnosis, worse: Sequence[str] = ()) -> str:
    """
    Return the colour of a verdict.

    None is good if the model is doubted, or not patched with what was named, if a joint is not
    checked, or a simulation got worse in some joints.

    """
    tone = _TONES.get(diagnosis.verdict, 'bad')
    open_ends = diagnosis.not_checked, diagnosis.doubt, diagnosis.harmful
    return 'fair' if tone == 'good' and (any(open_ends) or worse) else tone


@dataclass(frozen=True)
class Extras:
    """
    Results that follow from a diagnosis: next run, simulation, learned residual.

    Attributes
    ----------
    forward : tuple of ForwardValidation
        Held-out recordings simulated with the given and with the patched model.
    next_run : NextRun or None
        A motion that separates names in doubt.
    no_run : str
        Why there is no next run, where names are in doubt.
    notes : tuple of str
        Reasons why a result is missing.
    residual : Residual or None
        Learned map of the unexplained residual.

    """

    forward: tuple[ForwardValidation, ...] = ()
    next_run: NextRun | None = None
    no_run: str = ''
    notes: tuple[str, ...] = ()
    residual: Residual | None = None

    def steps(self, diagnosis: Diagnosis, model: str = MODEL) -> list[str]:
        """Return the next steps for the page and the terminal, with the path of the model."""
        learned = self.residual is not None
        return next_steps(diagnosis, self.next_run, self.no_run, model, self.worse, learned)

    def sentences(self, diagnosis: Diagnosis) -> list[str]:
        """Return sentences on shares, minor effects, consequences and notes."""
        lines = [
            f'{names_and_places(group)}: {share_in_words(group[0])}'
            + (', together' if len(group) > 1 else '')
            for group in by_cause(diagnosis.findings)
        ]
        lines += [
            f'minor (significant, but negligible or not confirmed): '
            f'{name_in_words(one.name)} in {", ".join(one.joints) or "the whole arm"}, '
            f'p {probability(one.p)}'
            for one in diagnosis.minor
        ]
        lines += [] if self.residual is None else self.residual.sentences()
        lines += [pair.sentence() for pair in self.forward]
        if diagnosis.verdict == 'consistent':
            lines.append('note: how large each effect has to be to be seen is in report.html')
        lines += [f'note: {note}' for note in (*diagnosis.notes, *self.notes)]
        return lines

    @property
    def worse(self) -> tuple[str, ...]:
        """Joints in which a simulation with the patched model is worse than before."""
        return tuple(dict.fromkeys(joint for pair in self.forward for joint in pair.worse))


#: What recordings were used for, and the words for some of them.
_ROLES = (
    ('training', 'recording', '{}'),
    ('held-out', 'held-out recording', '{}'),
    ('baseline', 'recording', '{} from before'),
    ('simulator', 'recording', '{} of a simulator'),
)


def diagnosis_report(
    diagnosis: Diagnosis,
    read: Mapping[str, Sequence[Recording]],
    *,
    everything: bool = False,
    extras: Extras | None = None,
    patch: str = '',
    origin: ResultOrigin = DEFAULT_ORIGIN,
) -> str:
    """
    Return report.html of a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.
    read : mapping of str to sequence of Recording
        Recordings by what they were used for: 'training', 'held-out',
        'baseline', 'simulator'.
    everything : bool
        Whether negligible effects were added to the model.
    extras : Extras, optional
        What was made of it.
    patch : str
        model.yaml of the patched model.
    origin : ResultOrigin
        Robot, files, versions, settings, seed.

    Returns
    -------
    str
        One HTML file that loads nothing.

    """
    extras, arm = extras or Extras(), diagnosis.arm
    recordings = [(one, role) for role, several in read.items() for one in several]
    names = short_names([one.source for one, _ in recordings])
    residual, patched = extras.residual, bool(diagnosis.findings)
    steps = list(map(pretty, extras.steps(diagnosis)))
    if residual is not None:
        steps += residual.steps()
    sections: list[Section] = [_verdict(diagnosis, names, extras.worse, ''.join(steps[:1]))]
    curves = whole_overlays(diagnosis, [one for one, _ in recordings])
    if curves is not None and diagnosis.gap is not None:
        sections += [
            overlay_section(diagnosis, curves, names),
            Story(diagnosis, residual),
            gap_section(diagnosis, diagnosis.gap),
            *([named_section(diagnosis.findings)] if patched else []),
        ]
        if diagnosis.where:
            sections.append(evidence_section(diagnosis))
    if residual is not None:
        sections.append(residual.section())
    sections.append(next_steps_section(steps))
    if diagnosis.minor:
        sections.append(minor_section(diagnosis, everything))
    if diagnosis.gap is not None:
        sizes = detectable(diagnosis.explanation)
        sections += [candidates_section(diagnosis), detectable_section(sizes)]
    if extras.forward:
        pairs = [
            replace(pair, after=replace(pair.after, source=names[pair.after.source]))
            if pair.after.source in names
            else pair
            for pair in extras.forward
        ]
        sections.append(forward_section(arm.robot, pairs, ('as it was', 'patched')))
    quality = [(one, role, ()) for one, role in recordings]
    at_fault = _at_fault(diagnosis, read, names)
    sections.append(data_quality_section(quality, at_fault=at_fault, names=names))
    if patched and not diagnosis.harmful:
        sections.append(patch_section(diagnosis.findings, patch))
    sections.append(Origin(origin.provenance))
    used = [
        kind.format(counted(len(read[role]), noun))
        for role, noun, kind in _ROLES
        if read.get(role)
    ]
    subtitle = ' · '.join([robot_label(origin.robot), *used])
    joints = (*arm.robot.joints, *arm.robot.links)
    return Page(f'Diagnosis of {arm.robot.name}', subtitle, sections, names=joints).html()


def _at_fault(
    diagnosis: Diagnosis, read: Mapping[str, Sequence[Recording]], names: Mapping[str, str]
) -> list[str]:
    """Return the recordings that a BAD DATA verdict names, or all; [] for other verdicts."""
    if diagnosis.verdict != 'bad_data':
        return []
    sources = [one.source for several in read.values() for one in several if one.source]
    whole = r'(?<![\w/]){}(?![\w/])'
    named = [x for x in sources if re.search(whole.format(re.escape(x)), diagnosis.summary)]
    found = named or [one.source for one in read['training']]
    return [names.get(source, source) or 'in memory' for source in found]


def _verdict(
    diagnosis: Diagnosis, names: Mapping[str, str], worse: Sequence[str], step: str
) -> VerdictSection:
    tone = tone_of(diagnosis, worse)
    notes = [
        with_names(f'{note[0].upper()}{note[1:].rstrip(".")}.', names) for note in diagnosis.notes
    ]
    if worse:
        notes.append(
            f'Driven by the recorded torques, the patched model has larger position errors than '
            f'before in {", ".join(worse)}; see Forward validation.'
        )
    first, stop, more = pretty(with_names(diagnosis.summary, names)).partition('. ')
    badge, bars = diagnosis.verdict.replace('_', ' '), None
    if diagnosis.gap is not None and diagnosis.findings:
        bars = share_bars(diagnosis)
    sentences = [first + stop.rstrip(), *filter(None, [more])]
    return VerdictSection(badge, tone, sentences, notes, bars, with_names(step, names))


@dataclass(frozen=True)
class Story(Section):
    """
    The story of a diagnosis: questions of a reader with their answers.

    Attributes
    ----------
    diagnosis : Diagnosis
        What was found.
    residual : Residual or None
        The learned residual.

    """

    title: ClassVar[str] = 'In short'
    template: ClassVar[str] = 'story.html'

    diagnosis: Diagnosis
    residual: Residual | None = None

    @property
    def drawing(self) -> ArmDrawing:
        """Draw the arm in a recorded pose, with the joints of the largest cause coloured."""
        data, robot = self.diagnosis.data, self.diagnosis.arm.robot
        cause: list[Finding] = next(iter(by_cause(self.diagnosis.findings)), [])
        names = ', '.join(name_in_words(one.name) for one in cause)
        found = [*(place.joint for place in self.diagnosis.where), *self._gains]
        named = {joint for one in cause for joint in one.joints}
        joints = [joint for joint in robot.all_joints if joint in named] if cause else found[:1]
        caption = f'coloured: {", ".join(joints)} ({names or "the largest gap"})'
        if any(not one.joints for one in cause):
            joints, caption = list(robot.joints), f'coloured: the whole arm ({names})'
        q = np.concatenate([part.at_rows.q for part in data]) if data else None
        return draw_arm(robot, joints, q, caption if joints else 'no joint stands out')

    @property
    def rows(self) -> list[tuple[str, list[str]]]:
        """Questions and answers."""
        answers = [('Where', self._where()), ('Patch', self._patch()), ('Gap', self._gap())]
        if self.diagnosis.spans:
            answers.insert(
                0,
                (
                    'When',
                    [
                        f'{one.source} from {one.start:.1f} to {one.stop:.1f} s'
                        for one in self.diagnosis.spans
                    ],
                ),
            )
        rest = self.diagnosis.left
        if self.diagnosis.findings and rest:
            answers.append(('Unexplained', [f'{w.joint}: {w.signature}' for w in rest[:_JOINTS]]))
        return answers

    @property
    def _gains(self) -> Mapping[str, float]:
        return {} if self.residual is None else self.residual.gains

    def _where(self) -> list[str]:
        places, whole = self.diagnosis.where, share_of(self.diagnosis)
        lines = [
            f'{place.joint}: {percent(place.share_of_gap)} of {whole}, {place.signature}'
            for place in places[:_JOINTS]
        ]
        if len(places) > _JOINTS:
            rest = sum(place.share_of_gap for place in places[_JOINTS:])
            others = ', '.join(place.joint for place in places[_JOINTS:])
            lines.append(f'{others}: {percent(rest)}')
        unseen = self.diagnosis.not_checked
        if not lines and self.diagnosis.verdict != 'consistent':
            return ['No joint is far above its floor.']
        none = 'No joint that was checked has a gap.' if unseen else 'No joint has a gap.'
        gap, joints = self.diagnosis.gap, self.diagnosis.arm.robot.joints
        if gap is not None and gap.predicted and places:
            joint = places[0].joint
            if gap.chi2_before[joints.index(joint)] <= 1.0:
                held_out = f'in the held-out ones {joint} is below its floor'
                lines.insert(0, f'In the fitted recordings only; {held_out}:')
        lines = lines or [none]
        return [*lines, f'Not checked: {", ".join(unseen)}.'] if unseen else lines

    def _patch(self) -> list[str]:
        diagnosis = self.diagnosis
        patched = not diagnosis.harmful
        added = [name_in_words(finding.name) for finding in diagnosis.findings if patched]
        if self._gains:
            added.append(f'the learned residual of {", ".join(self._gains)}')
        if not added:
            return ['The model is unchanged.']
        more = ', with rigid body and friction refitted' * (diagnosis.refitted and patched)
        return [f'model.yaml is the model with {" and ".join(added)}{more}.']

    def _gap(self) -> list[str]:
        gap, robot = self.diagnosis.gap, self.diagnosis.arm.robot
        if gap is None:
            return ['Not measured.']
        j = int(np.argmax(gap.chi2_before))
        before, after, floor = (
            f'{digits(float(x[j]))} {robot.torque_units[j]}'
            for x in (gap.before, gap.after, gap.floor)
        )
        where = 'on held-out recordings' if gap.predicted else f'on {gap.data}'
        change = f'{before} before, {after} after' if self.diagnosis.findings else after
        return [
            f'{robot.joints[j]}: {change}, {where}.',
            f'The floor, {floor}, is {self.diagnosis.baseline}.',
            *(
                f'{joint}: the map predicts {percent(gain)} of the residual without a known cause.'
                for joint, gain in self._gains.items()
            ),
        ]
