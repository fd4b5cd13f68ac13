# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From findings to a verdict: a word and a sentence that the evidence supports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.verdict.finding import Finding, SAID
from armid_ros.diagnosis.verdict.where import Excess
from armid_ros.effects import CATALOGUE, Shape
from armid_ros.estimate import ParameterName
from armid_ros.identification.fitting.identifiability import excludes_zero, HALF_WIDTH
from armid_ros.motion import FloatArray
from armid_ros.robots import Robot
import numpy as np

Word = Literal[
    'consistent', 'named', 'ambiguous', 'partial', 'unknown', 'not_repeatable', 'bad_data'
]
#: A sentence with more joints than this only counts them; tables have the rest.
_JOINTS_SAID = 3
#: Nouns that take an article: a spring, but viscous friction.
_COUNTED = {'spring', 'offset', 'delay', 'tilt', 'limit', 'gain', 'coupling', 'change'}
#: What a share is of, where something is named and where nothing is.
_GAP, _LEFT = 'the gap', 'what is left'


@dataclass(frozen=True)
class Verdict:
    """
    The word and the sentence.

    Attributes
    ----------
    word : str
        See ``Word``.
    summary : str
        A sentence or two.

    """

    word: Word
    summary: str


@dataclass(frozen=True)
class Hiding:
    """
    What may hide beside the misfit of a model.

    Attributes
    ----------
    misfit : ndarray, shape (n,)
        The misfit of each joint, as a share of its torque; both root mean square.
    change : ndarray, shape (n,)
        The largest change that does not open a gap, in the same measure.

    """

    misfit: FloatArray
    change: FloatArray


@dataclass(frozen=True)
class Unnamed:
    """
    What is not in the headline.

    Attributes
    ----------
    minor : sequence of Finding
        The small print, the most important first.
    suspected : sequence of Finding
        What more recordings may tell from what those of one day differ by.
    unproven : sequence of Finding
        What takes most of a gap, where the baseline does not tell whether it has changed.

    """

    minor: Sequence[Finding] = ()
    suspected: Sequence[Finding] = ()
    unproven: Sequence[Finding] = ()


def decide(
    findings: Sequence[Finding],
    strange: Sequence[str],
    left: Sequence[Excess],
    arm: ArmModel,
    floor_in_words: str,
    as_it_is: Excess | None = None,
    unnamed: Unnamed = Unnamed(),
    hides: Hiding | None = None,
) -> Verdict:
    """
    Decide the verdict.

    Parameters
    ----------
    findings : sequence of Finding
        The headline.
    strange : sequence of str
        Joints that do not repeat in equal periods; see `not_repeating`.
    left : sequence of Excess
        Losses of the model with the names over their limits, for each set of data.
    arm : ArmModel
        Gives the joints.
    floor_in_words : str
        The floor of the gap: noise, or a misfit.
    as_it_is : Excess or None
        The same of the model with its rigid body as it was, where ``left`` is with one that was
        fitted: the patched model, or the given one where nothing is named.
    unnamed : Unnamed
        What is not in the headline.
    hides : Hiding or None
        What may hide beside the floor where that is a misfit.

    """
    worst = max(left, key=lambda one: float(one.ratio.max()))
    open_gap = bool(worst.ratio.max() > 1.0)
    joint = arm.robot.joints[int(np.argmax(worst.ratio))]
    if strange and (not findings or open_gap):
        return Verdict('not_repeatable', _strange(strange, findings))
    rest = (
        f'the error of {joint} {worst.where} is {larger(np.sqrt(worst.ratio.max()))} '
        f'{floor_in_words} can be{worst.more}'
    )
    refit = _refit(as_it_is, arm.robot, floor_in_words)
    if not findings:
        if open_gap:
            return Verdict('unknown', f'Something is missing: {rest}. {_unexplained(unnamed)}')
        text = f'{refit}{_consistent(floor_in_words, unnamed.minor)}'
        hidden = [] if hides is None else [_could_hide(hides, unnamed.minor, arm.robot)]
        told = [suspicion(group) for group in by_cause(unnamed.suspected)]
        return Verdict('consistent', ' '.join([text, *hidden, *told]))
    said, tied = _sentences(findings), _rivals_in_words(findings)
    if open_gap:
        return Verdict('partial', f'{said}{tied} There is more: {rest}.')
    if tied:
        return Verdict('ambiguous', f'{said}{tied}')
    level = floor_in_words if hides is None else 'back at its level before the change'
    return Verdict('named', f'{refit}{said} The remaining error is {level}.')


def _rivals_in_words(findings: Sequence[Finding]) -> str:
    """Say which names may be others, a sentence with a space before it; '' where none may."""
    several = len(findings) > 1
    pairs = [
        f'{f"the {one.name}".replace("_", " ") if several else "it"} from {others_in_words(one)}'
        for one in findings
        if one.rivals
    ]
    return f' These data cannot tell {", nor ".join(pairs)}.' if pairs else ''


def _consistent(floor_in_words: str, minor: Sequence[Finding]) -> str:
    """Say that a model explains the data, and what is too small to matter."""
    small = [sentence(one, _LEFT) for one in minor[:1] if one.share >= SAID]
    text = f'The model explains the recordings: what is left is no more than {floor_in_words}'
    return f'{text}, or too small to matter. {small[0]}' if small else f'{text}.'


def _refit(as_it_is: Excess | None, robot: Robot, floor_in_words: str) -> str:
    """Say that rigid body and friction were refitted, and how far off they were as given."""
    if as_it_is is None or as_it_is.ratio.max() <= 1.0:
        return ''
    joint = robot.joints[int(np.argmax(as_it_is.ratio))]
    times = larger(np.sqrt(as_it_is.ratio.max()))
    return (
        f'Rigid body and friction were refitted: as given, the error of {joint} is {times} '
        f'{floor_in_words} can be. '
    )


def _could_hide(hides: Hiding, minor: Sequence[Finding], robot: Robot) -> str:
    """Say how large a change may be in the joint of the largest misfit before it shows."""
    worst = int(np.argmax(hides.misfit))
    joint = robot.joints[worst]
    like = [one.name.replace('_', ' ') for one in minor if joint in one.joints]
    such = f', such as the {like[0]} of the small print' if like else ''
    return (
        f'In {joint} that misfit is {percent(hides.misfit[worst])} of the torque: a change of up '
        f'to {percent(hides.change[worst])} of it can hide there{such}.'
    )


def _unexplained(unnamed: Unnamed) -> str:
    """Say that no cause explains a gap, and what explains most of it where something does."""
    if unnamed.minor and unnamed.minor[0].share >= SAID:
        return f'Nothing in the catalogue closes it. {sentence(unnamed.minor[0])}'
    told = [suspicion(group) for group in by_cause(unnamed.suspected)]
    told = told or [_unproven(group) for group in by_cause(unnamed.unproven)]
    return ' '.join(told or ['Nothing in the catalogue explains it.'])


def larger(ratio: float) -> str:
    """Say how much larger an error is than another one."""
    if ratio < 1.05:
        return 'a little larger than'
    return f'{ratio:.0f} times as large as' if ratio >= 100.0 else f'{ratio:.1f} times as large as'


def sentence(finding: Finding, of: str = _GAP) -> str:
    """Say in a sentence what a cause is and how much it explains, of the gap or what is left."""
    return f'{_subject(finding)} explains {share_in_words(finding, of=of)}.'


def suspicion(group: Sequence[Finding]) -> str:
    """Say what a cause would explain that the recordings do not tell from their own spread."""
    return (
        f'{_subjects(group)} would explain {share_in_words(group[0], of=_LEFT)}: these '
        'recordings hardly tell it from what those of one day differ by.'
    )


def _unproven(group: Sequence[Finding]) -> str:
    """Say what a cause would explain that may have been there before."""
    return (
        f'{_subjects(group)} would explain {share_in_words(group[0])}, and is not named, as the '
        'recordings from before do not tell whether it was there then.'
    )


def share_interval_in_words(finding: Finding) -> str:
    """Return the 95 % interval of a share in brackets; empty where its ends read alike."""
    low, high = (percent(end) for end in finding.share_interval)
    return f' ({low} to {high})' if low != high else ''


def share_in_words(finding: Finding, interval: bool = False, of: str = _GAP) -> str:
    """
    Return the share of the gap that a cause takes, and the joint that needs it though it is small.

    Parameters
    ----------
    finding : Finding
        The cause.
    interval : bool
        Whether with its 95 % interval.
    of : str
        What it is a share of: no gap is open where nothing is named.

    """
    text = f'{percent(finding.share)} of {of}'
    text += share_interval_in_words(finding) if interval else ''
    joint, taken = finding.of_joint
    if not joint:
        return text
    how_much = 'most' if taken > 0.5 else 'part'
    return f'{text}, and {how_much} of what the others leave in {joint}'


def percent(share: float) -> str:
    """Return a share as a percentage, the digit that matters kept: '96 %', '0.4 %'."""
    size = abs(100.0 * share)
    return f'{100.0 * share:z.0f} %' if size >= 2.0 or size < 0.05 else f'{100.0 * share:.1f} %'


def _sentences(findings: Sequence[Finding]) -> str:
    """Say in sentences what was named; names that are one cause share one."""
    said: list[str] = []
    for group in by_cause(findings):
        explain = 'explains' if len(group) == 1 else 'together explain'
        said.append(f'{_subjects(group)} {explain} {share_in_words(group[0])}.')
        said += [text for one in group for text in _left_open(one)]
    return ' '.join(said)


def _subjects(group: Sequence[Finding]) -> str:
    """Return what names that are one cause are, where, and their values."""
    names = ' and '.join(one.name.replace('_', ' ') for one in group)
    where = {_in_many(one) for one in group}
    if len(where) == 1 and all(where):
        return f'{names.capitalize()}{where.pop()}'
    first, *others = (_subject(one) for one in group)
    return ' and '.join([first, *(text[0].lower() + text[1:] for text in others)])


def names_and_places(group: Sequence[Finding]) -> str:
    """Return what names that are one cause are, and where."""
    joints = dict.fromkeys(joint for one in group for joint in one.joints)
    names = ' and '.join(one.name.replace('_', ' ') for one in group)
    return f'{names} of {", ".join(joints) or "the whole arm"}'


def by_cause(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Return findings, those together that are one cause and have their share in common."""
    groups: list[list[Finding]] = []
    done: set[str] = set()
    for one in findings:
        if one.name not in done:
            group = [one, *(other for other in findings if other.name in one.together)]
            done.update(other.name for other in group)
            groups.append(group)
    return groups


def _subject(finding: Finding) -> str:
    """Return what a cause is, where, and its values."""
    words = finding.name.replace('_', ' ').replace('coulomb', 'Coulomb')
    counted = finding.weighs or words.split()[-1] in _COUNTED
    article = f'a{"n" if words[0] in "aeiou" else ""} ' if counted else ''
    subject = f'{article}{words}'[:1].upper() + f'{article}{words}'[1:]
    if finding.ties:
        where = ', '.join(_tie(finding, tie.joint, tie.name) for tie in finding.ties)
        return f'{subject} at {where}'
    if finding.weighs:
        return f'{subject} {_weight(finding)}'
    many = _in_many(finding)
    if many:
        return f'{subject}{many}'
    where = f' in {", ".join(finding.joints)}' if finding.joints else ''
    shown = [] if len(finding.joints) > 1 else list(_values(finding))
    shown = [shown[0], f'and {len(shown) - 1} more'] if len(shown) > 2 else shown
    meant = f': {finding.sign}' if finding.sign else ''
    numbers = f' ({", ".join(shown)}{meant})' if shown else ''
    return f'{subject}{where}{numbers}'


def _in_many(finding: Finding) -> str:
    """Say in how many joints a cause is, and by how much it was more; nothing where few."""
    if len(finding.joints) <= _JOINTS_SAID:
        return ''
    return f' in {len(finding.joints)} joints{_by_shares(finding)}'


def _by_shares(finding: Finding) -> str:
    """Say by how much of what they were values have changed; nothing where they were nothing."""
    had = np.array(finding.had)
    if not len(had) or not np.all(had):
        return ''
    ends = sorted(np.round(100.0 * np.array(finding.values) / had).tolist())
    span = ' to '.join(dict.fromkeys(f'{end:z.0f}' for end in (ends[0], ends[-1])))
    return f' (by {span} % of what it was)'


def _values(finding: Finding) -> Iterator[str]:
    """
    Yield the values of a cause, with the name where it differs from that of the one before.

    Values whose interval includes zero are left to the table, unless all do.

    """
    before = ''
    rows = zip(finding.parameters, finding.values, finding.std, finding.had, strict=True)
    every = [row for row in rows if not vague(finding, *row[:3])]
    not_zero = [row for row in every if excludes_zero(row[1], row[2])]
    for p, value, std, had in not_zero or every:
        name = '' if p.name == before else f'{p.words} '
        yield f'{name}{_with_degrees(value, std, p.unit)}{added(had)}'
        before = p.name


def vague(finding: Finding, parameter: ParameterName, value: float, std: float) -> bool:
    """Return whether the data do not determine a value of a cause: its digits mean nothing."""
    shape = _shape(finding, parameter)
    if shape is None:
        return not np.isfinite(std)
    return not shape.determined(value, HALF_WIDTH * std)


def _shape(finding: Finding, parameter: ParameterName) -> Shape | None:
    """Return what the catalogue says of a shape; None for a quantity."""
    shapes = CATALOGUE[finding.name].shapes if finding.name in CATALOGUE else ()
    return next((shape for shape in shapes if shape.name == parameter.name), None)


def _left_open(finding: Finding) -> list[str]:
    """Return a sentence on the shapes of a cause that the data leave open, or none."""
    rows = zip(finding.parameters, finding.values, finding.std, strict=True)
    left = [row[0] for row in rows if _shape(finding, row[0]) and vague(finding, *row)]
    if not left:
        return []
    names = ' and '.join(dict.fromkeys(p.words for p in left))
    return [
        f'These recordings do not determine its {names}; what shows it is '
        f'{CATALOGUE[finding.name].traits.shown_by}.'
    ]


def added(had: float) -> str:
    """Say what a value is added to; nothing where that is zero."""
    return f', added to {had:.4g}' if had else ''


def _weight(finding: Finding) -> str:
    """Return the mass of a payload, or that it is not determined, where it is, if put down."""
    mass, std = _mass(finding)
    known = abs(mass) > HALF_WIDTH * std
    text = (
        f'of {as_sure(abs(mass), std)} kg' if known else 'whose mass these data do not determine'
    )
    return f'{text} on {finding.joints[0]}{" that was put down" if known and mass < 0.0 else ""}'


def _mass(finding: Finding) -> tuple[float, float]:
    """Return the mass of a payload and its deviation [kg], zero where it is not determined."""
    rows = zip(finding.parameters, finding.values, finding.std, strict=True)
    return next(((value, std) for p, value, std in rows if p.unit == 'kg'), (0.0, 0.0))


def _with_degrees(value: float, std: float, unit: str) -> str:
    """Return a value with its interval; an angle in degrees as well, to the same digits."""
    text = f'{as_sure(value, std)} {unit}'.strip()
    degrees, *_ = as_sure(np.rad2deg(value), np.rad2deg(std)).split(' ')
    return f'{text}, {degrees} degrees' if unit == 'rad' else text


def _strange(joints: Sequence[str], findings: Sequence[Finding]) -> str:
    text = (
        f'Equal periods differ in {", ".join(joints)} by more than noise, and not with time or '
        'velocity: something acts that does not repeat, such as contact or a person. '
    )
    if findings:
        names = ', '.join(finding.name.replace('_', ' ') for finding in findings)
        return text + f'{names} is provisional.'
    return text + 'No effect of the arm is named.'


def _tie(finding: Finding, joint: str, segment: str) -> str:
    shown = [
        f'{p.words} {as_sure(value, std)} {p.unit}'
        for p, value, std in finding.values_of(joint)
        if not vague(finding, p, value, std)
    ]
    return f'{segment} ({", ".join(shown)})' if shown else segment


def others_in_words(finding: Finding) -> str:
    """Return the rivals of a name in words, with their joints if any rival has other joints."""
    elsewhere = any(set(rival.joints) != set(finding.joints) for rival in finding.rivals)
    words = []
    for rival in finding.rivals:
        place = f' of {", ".join(rival.joints)}' if elsewhere and rival.joints else ''
        name = 'one' if rival.name == finding.name else rival.name.replace('_', ' ')
        words.append(name + place)
    return ' or '.join(words)


def as_sure(value: float, std: float) -> str:
    """Return a value and the half-width of its 95 % interval, to two digits of the latter."""
    wide = HALF_WIDTH * std
    if not 0.0 < wide < np.inf:
        return f'{value:.4g}'
    decimals = max(0, 1 - int(np.floor(np.log10(wide))))
    return f'{value:z.{decimals}f} +- {wide:.{decimals}f}'
