# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One arm on two days: a model is identified on the first, and the second is diagnosed.

All benchmarks of two days call the diagnosis through this module.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import time
from typing import Any

from armid_ros.arm import ArmModel, Misfit
from armid_ros.diagnosis import diagnose, diagnosis_document, DiagnosisSettings
from armid_ros.diagnosis.verdict.finding import Gap
from armid_ros.effects import CATALOGUE, USUAL_EFFECTS
from armid_ros.identification import Identification, identify
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np

from tests.hidden.arrays import Parameter

#: Verdicts of a gap that no known effect explains.
UNEXPLAINED = ('unknown', 'partial')


@dataclass(frozen=True)
class Named:
    """
    Named cause in the headline of a diagnosis.

    Attributes
    ----------
    name : str
        Name in the catalogue.
    joints : tuple of str
        Joints of the cause; empty for the whole arm.
    rivals : tuple of (name, joints)
        Rivals of the cause.
    parameters : tuple of (name, joint, value, std)
        Estimated parameters.
    share : float
        Share of the held-out gap that the cause explains; nan if not stated.
    share_interval : (float, float)
        The 95 % interval of the share.
    probability : float
        Probability of the cause; nan if not stated.

    """

    name: str
    joints: tuple[str, ...] = ()
    rivals: tuple[tuple[str, tuple[str, ...]], ...] = ()
    parameters: tuple[tuple[str, str, float, float], ...] = ()
    share: float = np.nan
    share_interval: tuple[float, float] = (np.nan, np.nan)
    probability: float = np.nan

    @property
    def names(self) -> set[str]:
        """Names of the cause and of its rivals."""
        return {self.name, *(name for name, _ in self.rivals)}

    def joints_of(self, name: str) -> tuple[str, ...]:
        """Return the joints of the cause, or of a rival with the given name."""
        return self.joints if name == self.name else dict(self.rivals).get(name, self.joints)

    def parameter_errors(self, truth: Sequence[Parameter]) -> list[tuple[float, bool]]:
        """
        Return the relative error of each parameter, and whether its interval has the true value.

        Returns
        -------
        list of (float, bool)
            Relative error, and whether the 95 % interval contains the truth. Parameters below a
            third of the largest one are left out.

        """
        stated = {(name, joint): (value, std) for name, joint, value, std in self.parameters}
        largest = max((abs(true.value) for true in truth), default=0.0)
        errors = []
        for true in truth:
            value, std = stated.get((true.name, true.joint), (np.nan, np.nan))
            if np.isfinite(value) and 3.0 * abs(true.value) >= largest > 0.0:
                error = abs(value - true.value)
                errors.append((error / abs(true.value), bool(error <= 1.96 * std)))
        return errors

    def __str__(self) -> str:
        """Return names, joints and share as a line of text."""
        where = ','.join(self.joints) if len(self.joints) < 4 else f'{len(self.joints)} joints'
        share = '' if np.isnan(self.share) else f' {self.share:.2f}'
        return '|'.join((self.name, *dict(self.rivals))) + (f'@{where}' if where else '') + share


@dataclass(frozen=True)
class Answer:
    """
    Verdict and headline of a diagnosis, or the error that ended it.

    Attributes
    ----------
    verdict : str
        Verdict in diagnosis.json; 'failed' after an exception.
    headline : tuple of Named
        Causes in the headline.
    seconds : float
        Processor time [s].
    error : str
        Reason why there is no diagnosis; empty if there is one.
    true_share : float
        True share of the cause in the held-out gap, in the rows and the unit of the stated shares;
        nan if unknown.

    """

    verdict: str
    headline: tuple[Named, ...] = ()
    seconds: float = np.nan
    error: str = ''
    true_share: float = np.nan


def known_arm(robot: Robot, known: Sequence[Any]) -> ArmModel:
    """Return the model of a described arm with known effects, with or without values."""
    arm = ArmModel(robot)
    for one in known:
        arm = arm.with_effect(CATALOGUE[one.name].on(robot, one.joints), one.values)
    return arm


def identification_of(robot: Robot, recordings: Sequence[Recording]) -> Identification:
    """Identify an arm with the default settings of `armid identify`."""
    arm = ArmModel.of(robot, effects=USUAL_EFFECTS)
    return identify(arm, list(recordings), rng=np.random.default_rng(0))


def ask(
    arm: ArmModel,
    recordings: Sequence[Recording],
    *,
    validate: Sequence[Recording] = (),
    baseline: Sequence[Recording] = (),
    misfit: Misfit | None = None,
    settings: DiagnosisSettings | None = None,
    contributions: Sequence[FloatArray] = (),
) -> Answer:
    """
    Diagnose an arm on the second day, and return the answer.

    Parameters
    ----------
    arm : ArmModel
        The given model.
    recordings, validate : sequence of Recording
        Fitted and held-out recordings of the day in question.
    baseline : sequence of Recording
        Recordings of the day on which the model was identified.
    misfit : Misfit, optional
        Misfit of the model when it was identified, without these recordings.
    settings : DiagnosisSettings, optional
        Settings of the diagnosis.
    contributions : sequence of ndarray, each (N, n), optional
        Torque of the cause in each recording, with those of ``validate`` last; gives the true
        share [N m].

    """
    begin = time.process_time()
    found = diagnose(
        arm,
        list(recordings),
        validate=list(validate),
        baseline=list(baseline),
        misfit=misfit,
        settings=settings,
        rng=np.random.default_rng(0),
    )
    seconds = time.process_time() - begin
    answer = answer_of(diagnosis_document(found), seconds)
    if not contributions or found.gap is None:
        return answer
    pairs = zip((*recordings, *validate), contributions, strict=True)
    made = [(recording.t, torque) for recording, torque in pairs]
    shown = made[len(recordings) :] if found.gap.predicted else made[: len(recordings)]
    return replace(answer, true_share=true_share(found.gap, shown))


def true_share(gap: Gap, made: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """
    Return the share of a gap that disappears when the torque of the true cause is subtracted.

    Parameters
    ----------
    gap : Gap
        The gap with its data.
    made : sequence of (ndarray, shape (N,), ndarray, shape (N, n))
        Times and torque of the cause in each recording of the gap [s, N m].

    """
    there = rest = 0.0
    for one in gap.overlays:
        part = one.trajectory
        t, whole = made[part.fold]
        torque = np.column_stack([np.interp(part.motion.t, t, tau) for tau in whole.T])
        weight = part.informative / one.sigma
        left = one.measured - one.before
        there += float(np.sum((left * weight) ** 2))
        rest += float(np.sum(((left - part.reduce(torque)) * weight) ** 2))
    return 1.0 - rest / there if there > 0.0 else float('nan')


def answer_of(document: dict[str, Any], seconds: float) -> Answer:
    """Read an answer from a document of the schema armid/diagnosis/1."""
    return Answer(
        verdict=document['verdict'],
        headline=tuple(_named(effect) for effect in document['effects']),
        seconds=seconds,
    )


def _named(effect: dict[str, Any]) -> Named:
    rivals = {rival['name']: tuple(rival['joints']) for rival in effect.get('rivals', ())}
    for name in effect.get('ambiguous_with', ()):
        rivals.setdefault(name, ())
    low, high = effect.get('share_interval') or (None, None)
    return Named(
        name=effect['name'],
        joints=tuple(effect['joints']),
        rivals=tuple(rivals.items()),
        parameters=tuple(
            (p['name'], p.get('joint') or '', _number(p['value']), _number(p.get('std')))
            for p in effect.get('parameters', ())
        ),
        share=_number(effect.get('share')),
        share_interval=(_number(low), _number(high)),
        probability=_number(effect.get('probability')),
    )


def _number(value: Any) -> float:
    return float('nan') if value is None else float(value)
