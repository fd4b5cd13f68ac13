# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Verdict of a diagnosis, such as `named`, and its sentences on causes and remaining error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.search.explanation import ESTIMATED, NOISE
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
#: Quantity of which a cause explains a share, in words.
DIFFERENCE = 'the difference between model and measurement'
#: Largest number of joints in the list of a sentence; further joints are only counted.
_MAX_JOINTS = 3
#: Largest ratio of an error to its floor that a sentence does not state.
_AT_FLOOR = 1.5


class Verdict(NamedTuple):
    """Verdict of a diagnosis: one word, and sentences that explain it."""

    word: Word
    summary: str
    contradicted: bool = False  # whether held-out data contradict the best candidate


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
    Decide the verdict from the findings and the remaining residual.

    Parameters
    ----------
    findings : sequence of Finding
        Findings of the headline.
    not_repeating : sequence of str
        Joints whose equal periods differ; see `joints_that_do_not_repeat`.
    excesses : sequence of Excess
        Squared residuals over their limits with the named effects, for each set of data.
    arm : ArmModel
        Arm with the names of the joints.
    floor : str
        The floor of the gap in words: noise, or a misfit.
    given_body : Excess or None
        Squared residuals over their limits with the given rigid body, if it was refitted.
    minor : sequence of Finding
        Minor findings, the most important first.
    gap : Gap, optional
        Residuals of the model with the findings, and their floor.

    """
    worst = max(excesses, key=lambda one: float(one.ratio.max()))
    open_gap = bool(worst.ratio.max() > 1.0)
    if not_repeating and (not findings or open_gap):
        names = ', '.join(name_in_words(finding.name) for finding in findings)
        text = (
            f'The torque of {", ".join(not_repeating)} differs between equal periods of the '
            'motion by more than noise. Its cause does not repeat, such as a contact or a person. '
            f'{f"{names} is provisional" if names else "No effect of the arm is named"}.'
        )
        return Verdict('not_repeatable', text)
    joints, units, largest = arm.robot.joints, arm.robot.torque_units, int(np.argmax(worst.ratio))
    number = '' if gap is None else f' ({gap.after[largest]:.2g} {units[largest]})'
    error = f'the error of {joints[largest]}{number} {worst.where}'
    size = f'{larger(np.sqrt(worst.ratio.max()))} the limit that follows from {floor}'
    refit, known = _refit(given_body, arm.robot, floor), floor not in (NOISE, ESTIMATED)
    ratio = np.zeros(len(joints)) if gap is None else gap.after / np.maximum(gap.floor, 1e-12)
    above, at_floor = known and ratio.max() > _AT_FLOOR, f'is at the level of {floor}'
    if above:
        at_floor = f'is {ratio.max():.1f} times {floor}, which another motion may cause'
    shown = bool(minor) and minor[0].share >= 0.01
    small = sentence(minor[0], DIFFERENCE if open_gap else 'the remaining error') if shown else ''
    if not findings:
        if open_gap and gap is not None and gap.predicted and minor and minor[0].share > 0.5:
            text = f'The held-out recordings contradict {names_and_places(minor[:1])}, which '
            share = percent(minor[0].share)
            return Verdict('unknown', f'{text}explains {share} of the others.', contradicted=True)
        if open_gap:
            text = f'No effect in the catalogue explains {error}. It is {size}.'
            text += f' Best candidate: {small}' if small else ''
            return Verdict('unknown', f'{text} {refit}'.rstrip())
        error = 'the error'
        if gap is not None:
            largest = int(np.argmax(ratio))
            error += f' of {joints[largest]} ({gap.after[largest]:.2g} {units[largest]})'
        changed = 'No change was found' if above else 'Nothing changed'
        lead = changed if known and not refit else 'The model explains the recordings'
        text = f'{lead}: {error} {at_floor}'
        text += f', or too small to matter. {small}' if small else '.'
        return Verdict('consistent', f'{refit}{text}')
    causes = _sentences(findings)
    if open_gap:
        return Verdict('partial', f'{causes} {refit}An error remains: {error} is {size}.')
    if any(one.other_causes for one in findings):
        return Verdict('ambiguous', f'{causes} {refit}'.rstrip())
    return Verdict('named', f'{causes} {refit}The remaining error {at_floor}.')


def _refit(given_body: Excess | None, robot: Robot, floor: str) -> str:
    """Return a sentence on the refit of body and friction if the given values fit badly."""
    if given_body is None or given_body.ratio.max() <= 1.0:
        return ''
    worst = int(np.argmax(given_body.ratio))
    times = larger(np.sqrt(given_body.ratio.max()))
    return (
        f'Rigid body and friction were refitted: as given, the error of {robot.joints[worst]} is '
        f'{times} the limit that follows from {floor}. armid check ROBOT BAG compares the links, '
        f'{robot.links[worst]} first. '
    )


def larger(ratio: float) -> str:
    """Return the ratio of two errors as text, such as '2.5 times as large as'."""
    if ratio < 1.05:
        return 'a little larger than'
    return f'{ratio:.0f} times as large as' if ratio >= 100.0 else f'{ratio:.1f} times as large as'


def sentence(finding: Finding, of: str = DIFFERENCE) -> str:
    """Return a sentence with a cause, its values, and the explained share of the gap."""
    text = f'{_subject(finding)} explains {percent(finding.share)} of {of}.'
    return text[:1].upper() + text[1:]


def share_interval_in_words(finding: Finding) -> str:
    """Return a share's 95 % interval in brackets; empty if both ends round to the same value."""
    low, high = (percent(end) for end in finding.share_interval)
    return f' ({low} to {high})' if low != high else ''


def percent(share: float) -> str:
    """Format a share as a percentage, such as '96 %' or '0.4 %'."""
    size = abs(100.0 * share)
    return f'{100.0 * share:z.0f} %' if size >= 2.0 or size < 0.05 else f'{100.0 * share:.1f} %'


def _sentences(findings: Sequence[Finding]) -> str:
    """Return sentences on all causes and rivals; the first names the two largest causes."""
    clauses: list[str] = []
    assumed: list[str] = []
    for group in by_cause(findings):
        causes = ' and '.join(map(_subject, group))
        explains = 'together explain' if len(group) > 1 else 'explains'
        end = ''
        if any(one.other_causes for one in group):
            assumed.append(f'Assumed: {causes}.')
            causes = f'either {" and ".join(map(_alternatives, group))}'
            end = ': these data cannot separate them'
        elif len(group) == 1 and _change(group[0]):
            explains = 'and explains'
        of = '' if clauses else f' of {DIFFERENCE}'
        clauses.append(f'{causes} {explains} {percent(group[0].share)}{of}{end}')
        assumed += [
            f'The link of {" or ".join(rival.joints)} may carry it instead: the torques are the '
            'same. The outer link is assumed.'
            for one in group
            for rival in one.rivals
            if rival.same_body
        ]
    parts = ['; '.join(clauses[:2]), *clauses[2:]]
    return ' '.join([*(f'{text[:1].upper()}{text[1:]}.' for text in parts), *assumed])


def names_and_places(group: Sequence[Finding | Rival]) -> str:
    """Return effect names and joints of findings as text, such as 'payload of wrist_3'."""
    joints = dict.fromkeys(joint for one in group for joint in one.joints)
    names = ' and '.join(name_in_words(one.name) for one in group)
    where = ', '.join(joints) if len(joints) <= _MAX_JOINTS else f'{len(joints)} joints'
    return f'{names} of {where or "the whole arm"}'


def by_cause(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Group the findings that stand for the same cause."""
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
    subject = name_in_words(finding.name)
    places = [finding.place_of(joint) for joint in finding.joints]
    if finding.weighs:
        mass, std = next((row[1:3] for row in finding.rows if row[0].unit == 'kg'), (0.0, 0.0))
        if not abs(mass) > HALF_WIDTH * std:
            return f'{subject} on {places[0]} (these data do not determine its mass)'
        gone = ' that was put down' if mass < 0.0 else ''
        return f'{subject} of {with_half_width(abs(mass), std)} kg on {places[0]}{gone}'
    if len(places) > _MAX_JOINTS:
        return f'{subject} in {len(places)} joints'
    change, meant = _change(finding), finding.sign
    if change:
        return f'{subject} of {places[0]} {change}' + (f' ({meant})' if meant else '')
    where = f' in {", ".join(places)}' if places else ''
    shown, before = [], ''
    for row in _rows(finding) if len(places) < 2 else ():
        name = '' if row[0].name == before else f'{row[0].words} '  # not repeated
        shown.append(f'{name}{_with_degrees(*row)}')
        before = row[0].name
    shown = [shown[0], f'and {len(shown) - 1} more'] if len(shown) > 2 else shown
    numbers = f' ({", ".join(shown)}{": " if meant else ""}{meant})' if shown else ''
    return f'{subject}{where}{numbers}'


def _change(finding: Finding) -> str:
    """Return old and new value of a known effect as text, such as 'rose from 2 to 3'."""
    rows = _rows(finding)
    if len(finding.joints) != 1 or len(rows) != 1 or not rows[0][3]:
        return ''
    return f'{"rose" if rows[0][1] > 0.0 else "fell"} {_with_degrees(*rows[0])}'


def _rows(finding: Finding) -> list[tuple[ParameterName, float, float, float]]:
    """Return the parameters whose interval excludes zero; all parameters if there are none."""
    every = [row for row in finding.rows if not vague(finding, *row[:3])]
    return [row for row in every if excludes_zero(row[1], row[2])] or every


def vague(finding: Finding, parameter: ParameterName, value: float, std: float) -> bool:
    """Return whether a fitted value is too uncertain to be written."""
    shapes = CATALOGUE[finding.name].shapes if finding.name in CATALOGUE else ()
    for shape in shapes:
        if shape.name == parameter.name:
            return not shape.determined(value, HALF_WIDTH * std)
    return not np.isfinite(std)


def _with_degrees(parameter: ParameterName, value: float, std: float, had: float) -> str:
    """Format a value with interval, unit and old value; angles also in degrees."""
    start = f'from {with_half_width(had, std).split(" ")[0]} to ' if had else ''
    text = f'{start}{with_half_width(had + value, std)} {parameter.unit}'.strip()
    degrees, *_ = with_half_width(np.rad2deg(had + value), np.rad2deg(std)).split(' ')
    return f'{text}, {degrees} degrees' if parameter.unit == 'rad' else text


def _alternatives(finding: Finding) -> str:
    """Return a finding and its rivals as text, with probabilities that sum to one."""
    every = [Rival(finding.name, finding.joints, finding.probability), *finding.other_causes]
    rest = 1.0 - finding.probability - sum(rival.probability for rival in finding.rivals)
    causes = [(names_and_places([one]), one.probability) for one in every]
    causes += [('another cause', rest)] if finding.probability and rest >= 0.01 else []
    words = ' or '.join(f'{cause} ({percent(share)})' for cause, share in causes)
    return words.replace('(', '(probability ', 1)


def with_half_width(value: float, std: float) -> str:
    """Format a value with the half-width of its 95 % interval, such as '3.04 ± 0.05'."""
    wide = HALF_WIDTH * std
    if not 0.0 < wide < np.inf:
        return f'{value:.4g}'
    decimals = max(0, 1 - int(np.floor(np.log10(wide))))
    return f'{value:z.{decimals}f} ± {wide:.{decimals}f}'
