# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From findings to a verdict: its word, and its sentence with the evidence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.verdict.finding import Finding, Gap, Rival
from armid_ros.diagnosis.verdict.where import Excess
from armid_ros.effects import CATALOGUE
from armid_ros.estimate import name_in_words, ParameterName
from armid_ros.identification.fitting.identifiability import excludes_zero, HALF_WIDTH
from armid_ros.robots import Robot
import numpy as np

Word = Literal[
    'consistent', 'named', 'ambiguous', 'partial', 'unknown', 'not_repeatable', 'bad_data'
]
#: Largest number of joints in the list of a sentence; further joints are only counted.
_MAX_JOINTS = 3


@dataclass(frozen=True)
class Verdict:
    """
    The verdict of a diagnosis.

    Attributes
    ----------
    word : str
        One of ``Word``.
    summary : str
        The verdict in a sentence or two.

    """

    word: Word
    summary: str


def decide(
    findings: Sequence[Finding],
    not_repeating: Sequence[str],
    excesses: Sequence[Excess],
    arm: ArmModel,
    floor: str,
    given_body: Excess | None = None,
    minor: Sequence[Finding] = (),
    gap: Gap | None = None,
) -> Verdict:
    """
    Return the verdict: word and sentence.

    Parameters
    ----------
    findings : sequence of Finding
        Findings of the headline.
    not_repeating : sequence of str
        Joints whose equal periods differ; see `not_repeating`.
    excesses : sequence of Excess
        Losses of the model with the named effects over their limits, for each set of data.
    arm : ArmModel
        Arm with the names of the joints.
    floor : str
        The floor of the gap in words: noise, or a misfit.
    given_body : Excess or None
        Losses with the rigid body as given, if ``excesses`` are with a refitted one.
    minor : sequence of Finding
        Minor findings, the most important first.
    gap : Gap, optional
        Errors of the model with the findings, and their floor.

    """
    worst = max(excesses, key=lambda one: float(one.ratio.max()))
    open_gap = bool(worst.ratio.max() > 1.0)
    if not_repeating and (not findings or open_gap):
        names = ', '.join(name_in_words(finding.name) for finding in findings)
        text = (
            f'Equal periods differ in {", ".join(not_repeating)} by more than noise, independent '
            'of time and velocity. Something acts that does not repeat, such as contact or a '
            f'person. {f"{names} is provisional" if names else "No effect of the arm is named"}.'
        )
        return Verdict('not_repeatable', text)
    error = f'the error of {arm.robot.joints[int(np.argmax(worst.ratio))]} {worst.where}'
    size = larger(np.sqrt(worst.ratio.max())) + f' expected from {floor}{worst.more}'
    no_larger = f'is no larger than {floor}'
    refit = _refit(given_body, arm.robot, floor)
    shown = bool(minor) and minor[0].share >= 0.01  # of the gap
    small = sentence(minor[0], 'the gap' if open_gap else 'the remaining error') if shown else ''
    if not findings:
        if open_gap:
            text = f'No effect in the catalogue explains {error}. It is {size}.'
            text += f' Best candidate: {small}' if small else ''
            return Verdict('unknown', f'{text} {refit}'.rstrip())
        number = ''
        if gap is not None:
            largest = int(np.argmax(gap.after / np.maximum(gap.floor, 1e-12)))
            unit = arm.robot.torque_units[largest]
            number = f' ({gap.after[largest]:.2g} {unit} in {arm.robot.joints[largest]})'
        text = f'The model explains the recordings: the remaining error{number} {no_larger}'
        text += f', or too small to matter. {small}' if small else '.'
        return Verdict('consistent', f'{refit}{text}')
    causes = _sentences(findings)
    rivals = ' '.join(
        f'Either {_alternatives(one)}: these data cannot separate them.'
        for one in findings
        if one.other_causes
    )
    if open_gap:
        if sum(group[0].share for group in by_cause(findings)) < 0.5:
            causes = causes.replace(' explains ', ' explains only ')
        first = f'{causes} {rivals}'.rstrip()
        return Verdict('partial', f'{first} {refit}There is more: {error} is {size}.')
    if rivals:
        return Verdict('ambiguous', f'{rivals} {causes} {refit}'.rstrip())
    return Verdict('named', f'{causes} {refit}The remaining error {no_larger}.')


def _refit(given_body: Excess | None, robot: Robot, floor: str) -> str:
    """Return a sentence on the refit, with the error of body and friction as given."""
    if given_body is None or given_body.ratio.max() <= 1.0:
        return ''
    worst = int(np.argmax(given_body.ratio))
    times = larger(np.sqrt(given_body.ratio.max()))
    return (
        f'Rigid body and friction were refitted: as given, the error of {robot.joints[worst]} is '
        f'{times} expected from {floor}. armid check ROBOT BAG compares the links, '
        f'{robot.links[worst]} first. '
    )


def larger(ratio: float) -> str:
    """Format the ratio of two errors."""
    if ratio < 1.05:
        return 'a little larger than'
    return f'{ratio:.0f} times as large as' if ratio >= 100.0 else f'{ratio:.1f} times as large as'


def sentence(finding: Finding, of: str = 'the gap') -> str:
    """Return a sentence: the cause and the share that it explains, by default of the gap."""
    return f'{_subject(finding)} explains {percent(finding.share)} of {of}.'


def share_interval_in_words(finding: Finding) -> str:
    """Return the 95 % interval of a share in brackets; empty if both ends are written alike."""
    low, high = (percent(end) for end in finding.share_interval)
    return f' ({low} to {high})' if low != high else ''


def share_in_words(finding: Finding) -> str:
    """Return the share of the gap that a cause explains, with its 95 % interval."""
    return f'{percent(finding.share)} of the gap{share_interval_in_words(finding)}'


def percent(share: float) -> str:
    """Format a share as a percentage, with a decimal below 2 %: '96 %', '0.4 %'."""
    size = abs(100.0 * share)
    return f'{100.0 * share:z.0f} %' if size >= 2.0 or size < 0.05 else f'{100.0 * share:.1f} %'


def _sentences(findings: Sequence[Finding]) -> str:
    """Return a sentence for each cause; findings of one cause have one sentence."""
    found: list[str] = []
    for group in by_cause(findings):
        first, *others = (_subject(one) for one in group)
        names = ' and '.join([first, *(text[0].lower() + text[1:] for text in others)])
        explain = 'together explain' if others else 'explains'
        found.append(f'{names} {explain} {percent(group[0].share)} of the gap.')
        found += [
            f'The link of {" or ".join(rival.joints)} may carry it instead: the torques are the '
            'same. The outer link is assumed.'
            for one in group
            for rival in one.rivals
            if rival.same_body
        ]
    return ' '.join(found)


def names_and_places(group: Sequence[Finding]) -> str:
    """Return the names and joints of findings of one cause."""
    joints = dict.fromkeys(joint for one in group for joint in one.joints)
    names = ' and '.join(name_in_words(one.name) for one in group)
    where = ', '.join(joints) if len(joints) <= _MAX_JOINTS else f'{len(joints)} joints'
    return f'{names} of {where or "the whole arm"}'


def by_cause(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Return groups of findings that have the same cause and the same share of the gap."""
    groups: list[list[Finding]] = []
    done: set[str] = set()
    for one in findings:
        if one.name not in done:
            group = [one, *(other for other in findings if other.name in one.together)]
            done.update(other.name for other in group)
            groups.append(group)
    return groups


def _subject(finding: Finding) -> str:
    """Return name, joints and values of a cause, as the subject of a sentence."""
    words = name_in_words(finding.name)
    subject = words[:1].upper() + words[1:]
    places = [finding.place_of(joint) for joint in finding.joints]
    if finding.weighs:
        rows = zip(finding.parameters, finding.values, finding.std, strict=True)
        mass, std = next(((m, s) for p, m, s in rows if p.unit == 'kg'), (0.0, 0.0))
        if not abs(mass) > HALF_WIDTH * std:
            return f'{subject} on {places[0]} (these data do not determine its mass)'
        gone = ' that was put down' if mass < 0.0 else ''
        return f'{subject} of {with_half_width(abs(mass), std)} kg on {places[0]}{gone}'
    if len(places) > _MAX_JOINTS:
        return f'{subject} in {len(places)} joints'
    where = f' in {", ".join(places)}' if places else ''
    shown = [] if len(places) > 1 else list(_values(finding))
    shown = [shown[0], f'and {len(shown) - 1} more'] if len(shown) > 2 else shown
    meant = f': {finding.sign}' if finding.sign else ''
    numbers = f' ({", ".join(shown)}{meant})' if shown else ''
    return f'{subject}{where}{numbers}'


def _values(finding: Finding) -> Iterator[str]:
    """
    Yield the formatted values of a cause; repeated parameter names are left out.

    Values whose interval includes zero are left out, unless all do. Values of the given model
    that are smaller than the interval are left out as well.

    """
    before = ''
    rows = zip(finding.parameters, finding.values, finding.std, finding.had, strict=True)
    every = [row for row in rows if not vague(finding, *row[:3])]
    not_zero = [row for row in every if excludes_zero(row[1], row[2])]
    for p, value, std, had in not_zero or every:
        name = '' if p.name == before else f'{p.words} '
        added = f', added to {had:.4g}' if had and not abs(had) < HALF_WIDTH * std else ''
        text = f'{with_half_width(value, std)} {p.unit}'.strip()
        if p.unit == 'rad':
            degrees, *_ = with_half_width(np.rad2deg(value), np.rad2deg(std)).split(' ')
            text += f', {degrees} degrees'
        yield f'{name}{text}{added}'
        before = p.name


def vague(finding: Finding, parameter: ParameterName, value: float, std: float) -> bool:
    """Return whether the data do not determine a value of a cause."""
    shapes = CATALOGUE[finding.name].shapes if finding.name in CATALOGUE else ()
    for shape in shapes:
        if shape.name == parameter.name:
            return not shape.determined(value, HALF_WIDTH * std)
    return not np.isfinite(std)


def _alternatives(finding: Finding) -> str:
    """List a name and its rivals with probabilities, and with joints if these differ."""
    every = (Rival(finding.name, finding.joints, finding.probability), *finding.other_causes)
    elsewhere = len({frozenset(one.joints) for one in every}) > 1
    words = ' or '.join(
        name_in_words(one.name)
        + (f' of {", ".join(one.joints)}' if elsewhere and one.joints else '')
        + f' ({percent(one.probability)})'
        for one in every
    )
    return words.replace('(', '(probability ', 1)


def with_half_width(value: float, std: float) -> str:
    """Format a value with the half-width of its 95 % interval, to two digits of the half-width."""
    wide = HALF_WIDTH * std
    if not 0.0 < wide < np.inf:
        return f'{value:.4g}'
    decimals = max(0, 1 - int(np.floor(np.log10(wide))))
    return f'{value:z.{decimals}f} ± {wide:.{decimals}f}'
