# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From an explanation to a verdict: names only where the data leave no other, or none at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from armid_ros.arm import ArmModel
from armid_ros.diagnosis.experiment import separating
from armid_ros.diagnosis.floor import Floor
from armid_ros.diagnosis.gap import Gap
from armid_ros.diagnosis.model_search import Explanation
from armid_ros.diagnosis.search import Step
from armid_ros.diagnosis.selection import Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
from armid_ros.effects import Effect
from armid_ros.effects.tied import Tied
from armid_ros.estimate import ParameterName
from armid_ros.model.spring_ties import Tie
import numpy as np

Word = Literal[
    'consistent', 'named', 'ambiguous', 'partial', 'unknown', 'not_repeatable', 'bad_data'
]


#: Several recordings whose periods differ slowly, each a little, tell as well: of 60 sets of
#: recordings in which nothing happened, none had a geometric mean of the structure above 2.4.
_SEVERAL, _ON_AVERAGE = 3, 3.5
#: A sentence with more joints than this only counts them; tables have the rest.
_JOINTS_SAID = 3


@dataclass(frozen=True)
class Rival:
    """A name that the data do not exclude in the place of another, and the joints it is on."""

    name: str
    joints: tuple[str, ...]


@dataclass(frozen=True)
class Finding:
    """
    One named effect.

    Attributes
    ----------
    name : str
        Its name in the catalogue.
    joints : tuple of str
        The joints it is on; none for the whole arm.
    parameters : tuple of ParameterName
        Its parameters, shapes included.
    values, std : tuple of float
        Their values and standard deviations; nan where the data do not tell.
    rivals : tuple of Rival
        What the data do not exclude in its place, the likeliest first.
    experiment : str
        What would separate them; empty if there is nothing to separate.
    gain : float
        Sum of squares over noise that it takes, held out.
    ties : tuple of Tie
        Where it holds the arm, in the order of its joints, if it ends at another machine.

    """

    name: str
    joints: tuple[str, ...]
    parameters: tuple[ParameterName, ...]
    values: tuple[float, ...]
    std: tuple[float, ...]
    rivals: tuple[Rival, ...]
    experiment: str
    gain: float
    ties: tuple[Tie, ...] = ()

    @property
    def ambiguous_with(self) -> tuple[str, ...]:
        """Names that the data do not exclude in its place."""
        return tuple(rival.name for rival in self.rivals)

    def place_of(self, joint: str) -> str:
        """Return where a joint's parameters act: at a segment that is tied, or the joint."""
        return next((tie.name for tie in self.ties if tie.joint == joint), joint)

    def of_joint(self, joint: str) -> list[tuple[ParameterName, float, float]]:
        """Return name, value and standard deviation of the parameters of one joint."""
        rows = zip(self.parameters, self.values, self.std, strict=True)
        return [row for row in rows if row[0].joint == joint]


@dataclass(frozen=True)
class Verdict:
    """
    The word, the sentence, the names.

    Attributes
    ----------
    word : str
        See ``Word``.
    summary : str
        A sentence or two.
    findings : tuple of Finding
        Effects by name, most of the gap first.

    """

    word: Word
    summary: str
    findings: tuple[Finding, ...]


def decide(
    explanation: Explanation,
    floors: Sequence[Floor],
    gap: Gap,
    settings: DiagnosisSettings,
    arm: ArmModel,
) -> Verdict:
    """Decide what may be said."""
    findings = _findings(explanation, arm)
    worst = float(np.max(explanation.losses))
    strange = _not_repeating(floors, arm)
    if strange and (not findings or worst > settings.partial_loss):
        return Verdict('not_repeatable', _strange(strange, findings), findings)
    if not findings:
        if worst <= settings.partial_loss:
            return Verdict('consistent', _consistent(explanation, gap), ())
        joint = arm.robot.joints[int(np.argmax(explanation.losses))]
        text = (
            f'Something is missing, most of it in {joint} ({worst:.2g} times the power of the '
            'noise), and nothing in the catalogue explains it. No name is given.'
        )
        return Verdict('unknown', text, ())
    if worst > settings.partial_loss:
        joint = arm.robot.joints[int(np.argmax(explanation.losses))]
        text = (
            f'Provisional: {_names(findings)} {_closes(gap)}, but {joint} is left at '
            f'{worst:.2g} times the power of the noise: there is more than this.'
        )
        return Verdict('partial', text, findings)
    if gap.predicted and np.max(gap.loss_after) > settings.held_out_loss:
        joint = arm.robot.joints[int(np.argmax(gap.loss_after))]
        text = (
            f'Provisional: {_names(findings)} explains the data it was found in, but where the '
            f'motion is new {joint} is left at {np.max(gap.loss_after):.2g} times the power of '
            'the noise: it is not this, or not only this.'
        )
        return Verdict('partial', text, findings)
    doubtful = [f for f in findings if f.rivals]
    if doubtful:
        first = doubtful[0]
        others = ' or '.join(_elsewhere(rival, first.joints) for rival in first.rivals)
        text = (
            f'{_names(findings)} {_closes(gap)}. These data cannot tell {first.name} from '
            f'{others}. {first.experiment}'
        )
        return Verdict('ambiguous', text, findings)
    return Verdict('named', f'{_names(findings)} {_closes(gap)}.', findings)


def _findings(explanation: Explanation, arm: ArmModel) -> tuple[Finding, ...]:
    fitted, steps = explanation.fitted, explanation.steps
    merged: dict[str, list[int]] = {}
    for index, named in enumerate(fitted.named):
        merged.setdefault(named.effect.name, []).append(index)
    starts = np.cumsum([0, *(len(named.kept) + len(named.effect.shape) for named in fitted.named)])
    std = fitted.estimate.std
    result = []
    for name, indices in merged.items():
        rows = [row for k in indices for row in range(starts[k], starts[k + 1])]
        rows = [row for row in rows if np.isfinite(std[row])]  # others the data do not tell
        joints = _joints([fitted.named[k].effect.joints for k in indices], arm)
        order = [joint for joint in arm.robot.joints if joint in joints]
        parameters = fitted.estimate.parameters
        rows.sort(key=lambda row: [*order, parameters[row].joint].index(parameters[row].joint))
        rivals = _rivals([steps[k] for k in indices], set(merged), arm)
        result.append(
            Finding(
                name,
                joints,
                tuple(parameters[row] for row in rows),
                tuple(float(fitted.estimate.values[row]) for row in rows),
                tuple(float(std[row]) for row in rows),
                rivals,
                separating(name, rivals[0].name, order) if rivals else '',
                float(sum(steps[k].trial.gain for k in indices)),
                _ties([fitted.named[k].effect for k in indices], order),
            )
        )
    return tuple(result)


def _ties(effects: Sequence[Effect], joints: Sequence[str]) -> tuple[Tie, ...]:
    ties = {t.joint: t for effect in effects if isinstance(effect, Tied) for t in effect.ties}
    return tuple(ties[joint] for joint in joints if joint in ties)


def _rivals(steps: Sequence[Step], named: set[str], arm: ArmModel) -> tuple[Rival, ...]:
    """Return the other names that are possible, the likeliest first, and where."""
    best: dict[str, list[Trial]] = {}
    for step in steps:
        here: dict[str, Trial] = {}
        for trial in sorted(step.rivals, key=lambda trial: -trial.gain):
            here.setdefault(trial.score.group.effect.name, trial)
        for name in here.keys() - named:
            best.setdefault(name, []).append(here[name])
    order = sorted(best, key=lambda name: -max(trial.gain for trial in best[name]))
    return tuple(
        Rival(name, _joints([trial.score.group.effect.joints for trial in best[name]], arm))
        for name in order
    )


def _joints(groups: Sequence[tuple[str, ...]], arm: ArmModel) -> tuple[str, ...]:
    """Return the joints of several effects of a name, in order but for those of pairs."""
    joints = [joint for group in groups for joint in group]
    if any(len(group) > 1 for group in groups):
        return tuple(dict.fromkeys(joints))
    return tuple(joint for joint in arm.robot.joints if joint in joints)


def _elsewhere(rival: Rival, joints: Sequence[str]) -> str:
    """Return a name, and the joints where they are others than those."""
    there = '' if set(rival.joints) == set(joints) else f' of {", ".join(rival.joints)}'
    return rival.name + (there if rival.joints else '')


def _not_repeating(floors: Sequence[Floor], arm: ArmModel) -> list[str]:
    """Return the joints that did not do the same in equal periods."""
    measured = [floor for floor in floors if floor.period is not None]
    if not measured:
        return []
    strange = np.array([~floor.repeats for floor in measured])
    often = strange.sum(axis=0) >= min(2, len(measured))
    if len(measured) >= _SEVERAL:
        structure = np.array([floor.structure for floor in measured])
        often |= np.exp(np.mean(np.log(np.maximum(structure, 1e-3)), axis=0)) > _ON_AVERAGE
    return [joint for joint, odd in zip(arm.robot.joints, often, strict=True) if odd]


def _strange(joints: Sequence[str], findings: Sequence[Finding]) -> str:
    text = (
        f'Equal periods differ in {", ".join(joints)} by more than noise, and not with time or '
        'velocity: something acts that does not repeat, such as contact or a person. '
    )
    if findings:
        return text + f'{_names(findings)} is provisional.'
    return text + 'No effect of the arm is named.'


def _consistent(explanation: Explanation, gap: Gap) -> str:
    worst = float(np.max(explanation.losses))
    how = (
        'as it is described'
        if explanation.base is None
        else 'once its rigid parameters and known effects are fitted; the described values are off'
    )
    return (
        f'The model explains the data {how}: every joint is within {worst:.2f} times the power '
        'of the noise.'
    )


def _names(findings: Sequence[Finding]) -> str:
    return '; '.join(_name(finding) for finding in findings)


def _name(finding: Finding) -> str:
    words = finding.name.replace('_', ' ')
    if finding.ties:
        return f'{words} at {", ".join(_tie(finding, tie) for tie in finding.ties)}'
    if len(finding.joints) > _JOINTS_SAID:
        return f'{words} in {len(finding.joints)} joints'
    where = f'{", ".join(finding.joints)}: ' if finding.joints else ''
    shown = [
        f'{p.name.replace("_", " ")} {value:.3g} +- {std:.1g} {p.unit}'.strip()
        for p, value, std in zip(finding.parameters, finding.values, finding.std, strict=True)
    ]
    if len(shown) > 3:
        shown = [*shown[:2], f'and {len(shown) - 2} more']
    return f'{where}{words} ({", ".join(shown)})'


def _tie(finding: Finding, tie: Tie) -> str:
    shown = [
        f'{p.name.replace("_", " ")} {_as_sure(value, std)} {p.unit}'
        for p, value, std in finding.of_joint(tie.joint)
    ]
    return f'{tie.name} ({", ".join(shown)})'


def _as_sure(value: float, std: float) -> str:
    """Return a value to the second digit of its deviation, and that."""
    if not 0.0 < std < np.inf:
        return f'{value:.4g}'
    decimals = max(0, 1 - int(np.floor(np.log10(std))))
    return f'{value:.{decimals}f} +- {std:.{decimals}f}'


def _closes(gap: Gap) -> str:
    where = 'held-out data' if gap.predicted else 'data left out of the fit'
    return f'closes {100 * gap.closed:.0f} % of the gap on {where}'
