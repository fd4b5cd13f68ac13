# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Grade of an identification, with reasons.

The grade follows from faults of the recordings, and from the torque error of the joint that is
predicted worst on held-out data. The error of a joint is a share of its own torque, as forces of a
slide [N] and torques of a wrist [N m] have no common unit. No model can predict white torque
noise, or the dry friction of a joint at rest.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.identification.assess.grade_limits import by_error, LIMITS, Word
from armid_ros.identification.assess.mistakes import shared_mistakes
from armid_ros.identification.assess.sensor_faults import Fault, sensor_faults, units_beyond_drives
from armid_ros.identification.identify import Identification
from armid_ros.identification.rows.checks import moving
from armid_ros.identification.rows.damage import without_damage
from armid_ros.identification.rows.regression import Fit, Score
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy import stats

#: Order of the reasons of a grade, the worst first.
_RANK: dict[Word, int] = {'unusable': 0, 'poor': 1, 'good': 2}


@dataclass(frozen=True)
class Grade:
    """
    Grade of an identification (good, poor or unusable), with its reasons.

    Attributes
    ----------
    word : {'good', 'poor', 'unusable'}
        The worst grade of all reasons.
    reasons : tuple of str
        Reasons, the worst first; at least one.
    faults : tuple of str
        Faults of the recordings themselves, the worst first, without a full stop.
    error_percent : float
        Relative torque error of the worst joint [%]: on held-out data if there are any, otherwise
        of one half of the data predicted from the other.
    worst_joint : str
        Joint with that error.

    """

    word: Word
    reasons: tuple[str, ...]
    faults: tuple[str, ...]
    error_percent: float
    worst_joint: str

    def document(self) -> dict[str, object]:
        """Return the grade as a dictionary for JSON."""
        return {
            'grade': self.word,
            'error_percent': self.error_percent,
            'worst_joint': self.worst_joint,
            'reasons': list(self.reasons),
        }


def grade(
    result: Identification,
    description: ArmModel,
    recordings: Sequence[Recording],
    validation: Mapping[str, Sequence[Fit]],
    held_out: Sequence[Recording] = (),
) -> Grade:
    """
    Grade an identification by faults of its recordings and by its torque errors.

    Parameters
    ----------
    result : Identification
        The identification.
    description : ArmModel
        Model before the identification.
    recordings, held_out : sequence of Recording
        Recordings of the fit, and the held-out recordings of `validation`.
    validation : mapping of str to sequence of Fit
        Torque predictions of the stretches of each held-out recording.

    """
    every, _ = without_damage([*recordings, *held_out], result.used)
    fits = [*result.training, *(fit for part in validation.values() for fit in part)]
    sensors = list(sensor_faults(description, every, fits, result.used))
    # a dead sensor causes other apparent mistakes in its recording
    blind = {fault.source for fault in sensors if fault.word == 'unusable'}
    seeing = [one for one in every if one.source not in blind]
    mistakes = []  # in names, signs, units, encoder zeros, delays or gravity
    for mistake, sources in shared_mistakes(description.body, seeing, result.used):
        text = mistake.sentence(description.body)
        if len(sources) < len(seeing):
            text = f'in {", ".join(dict.fromkeys(sources))}: {text}'
        error = 100.0 * float(mistake.before.joints[mistake.joint])
        certain = error > LIMITS.unusable and mistake.hypotheses[0].kind != 'scale'
        mistakes.append(Fault(text, 'unusable' if certain else 'poor'))
    units = units_beyond_drives(description.robot, seeing, [fit.motion for fit in fits])
    faults = [
        *(fault for fault in sensors if fault.word != 'good'),
        *(mistakes or (Fault(text, 'poor') for text in units)),
    ]
    worst: dict[str | None, _WorstJoint] = {
        bag: _worst_joint(Score.of(fits).joint_relative_error_percent, fits, result)
        for bag, fits in validation.items()
    }
    if not worst:
        halves = result.halves.joint_relative_error_percent
        worst = {None: _worst_joint(halves, result.training, result)}
    reasons = [
        *faults,
        *_torque_errors(result, worst, [fit for fits in validation.values() for fit in fits]),
        *_resting(result, validation),
        *(fault for fault in sensors if fault.word == 'good'),
    ]
    ordered = sorted(reasons, key=lambda one: _RANK[one.word])
    error, joint = max((one.measured, one.joint) for one in worst.values())
    return Grade(
        ordered[0].word,
        tuple(
            f'{text[0].upper()}{text[1:]}{"" if text.endswith("?") else "."}'
            for text in (reason.text for reason in ordered)
        ),
        tuple(fault.text for fault in ordered if fault in faults),
        error,
        result.arm.robot.joints[joint],
    )


def _torque_errors(
    result: Identification, worst: Mapping[str | None, _WorstJoint], held_out: Sequence[Fit]
) -> Iterator[Fault]:
    """Yield reasons of a grade: the largest torque error, and torques that are not predicted."""
    use = {
        'good': '',
        'poor': ', too large to compute torques',
        'unusable': ': the model does not describe this motion',
    }
    training = Score.of(result.training).joint_relative_error_percent
    fitted = beyond_noise(training, result.training, result.used)
    for bag, one in sorted(worst.items(), key=lambda item: -item[1].beyond):
        word = by_error(one.beyond)
        # a body of the right robot follows the recordings that it is fitted to
        wrong = word == by_error(float(fitted[one.joint])) == 'unusable'
        ask = ', also in the fit: names, signs or units are wrong, or an effect is missing' * wrong
        if bag is not None:
            text = f'torque error on {bag}, not used for the fit: {one.text}{ask or use[word]}'
            yield Fault(text, word)
            continue
        # without held-out data, each half of the data is predicted from the other half
        text = f'torque error in a cross-check of the two halves of the data: {one.text}{ask}'
        halves = result.halves.joint_relative_error_percent
        undetermined = halves > np.maximum(LIMITS.undetermined * training, 100.0 * LIMITS.floor)
        undetermined &= beyond_noise(halves, result.training, result.used) > 0.0
        if np.any(undetermined):
            joint = int(np.argmax(np.where(undetermined, halves, 0.0)))
            word = 'poor' if word == 'good' else word
            time = sum(float(fit.motion.t[-1] - fit.motion.t[0]) for fit in result.training)
            text += (
                f', but the training error of {result.arm.robot.joints[joint]} is '
                f'{training[joint]:.2g} %: {time:.2g} s of this motion do not determine '
                f'{result.base.rank} parameters; record longer, or more motion'
            )
        yield Fault(text, word)
    # held-out data, or training data if there are none
    fits = held_out or result.training
    every = Score.of(fits).joint_relative_error_percent
    if np.all(every[moving(fit.motion for fit in fits)] > LIMITS.unusable):
        yield Fault(f'the torque of no joint is predicted to {LIMITS.unusable:g} %', 'unusable')
        return
    noisy = every - beyond_noise(every, fits, result.used) > LIMITS.unusable
    if np.any(noisy):
        named = ', '.join(
            f'{result.arm.robot.joints[j]} ({every[j]:.0f} %)' for j in np.flatnonzero(noisy)
        )
        text = f'torques that are mostly noise or friction at rest are hardly predicted: {named}'
        yield Fault(text, 'good')


class _WorstJoint(NamedTuple):
    """Joint with the largest torque error: index, error with and without noise [%], and text."""

    joint: int
    measured: float
    beyond: float
    text: str


def _worst_joint(errors: FloatArray, fits: Sequence[Fit], result: Identification) -> _WorstJoint:
    """Return the joint with the largest torque error after subtraction of sensor noise."""
    joints, beyond = result.arm.robot.joints, beyond_noise(errors, fits, result.used)
    moves = moving(fit.motion for fit in fits)
    worst = int(np.lexsort((np.where(moves, errors, -1.0), beyond))[-1])
    measured, error = float(errors[worst]), float(beyond[worst])
    word = by_error(error)
    details = [f'{error:.3g} % without noise'] if word != by_error(measured) else []
    details += [f'worst joint: {joints[worst]}'] if len(joints) > 1 else []
    limit = LIMITS.unusable if word == 'unusable' else LIMITS.poor
    number = f'{measured:.0f}' if measured >= 99.5 else f'{measured:.2g}'
    text = f'{number} % ({", ".join([*details, f"limit {limit:g} %"])})'
    return _WorstJoint(worst, measured, error, text)


def _resting(result: Identification, validation: Mapping[str, Sequence[Fit]]) -> Iterator[Fault]:
    """Yield reasons of a grade: joints at rest, which cannot be identified or validated."""
    fitted = moving(fit.motion for fit in result.training)
    held_out = [fit.motion for part in validation.values() for fit in part]
    checked = moving(held_out) if held_out else fitted
    joints = np.array(result.arm.robot.joints)
    if not np.all(fitted):
        yield Fault(
            'joints that do not move are neither identified nor checked: '
            f'{", ".join(joints[~fitted])}; record a motion of all joints, or identify the others '
            f'alone with --joints {",".join(joints[fitted])}',
            'poor',
        )
    if np.any(fitted & ~checked):
        names = ', '.join(joints[fitted & ~checked])
        yield Fault(f'joints that do not move in held-out data are not checked: {names}', 'good')


def beyond_noise(errors: FloatArray, fits: Sequence[Fit], used: Conditioning) -> FloatArray:
    """
    Return each joint's relative torque error after subtraction of white sensor noise [%].

    The noise is computed from the median of second differences (Gasser, Sroka and Jennen-Steinmetz
    1986): torques of motion change little from row to row, and friction jumps in few rows only.
    Noise enters twice: in a row, and in its prediction, which is as uncertain as a measurement at
    a leverage of one (Hoaglin and Welsch 1978). An error as large as the sensor's is no error of
    the model.

    Parameters
    ----------
    errors : ndarray, shape (n,)
        Norm of the residual of each joint over that of its torque [%].
    fits : sequence of Fit
        Fits with these errors.
    used : Conditioning
        Filters of the rows.

    Returns
    -------
    ndarray, shape (n,)
        Errors without the noise [%]; zero for a joint at rest throughout.

    """
    size = Score.of(fits).torque_rms
    differences = np.concatenate([np.abs(np.diff(fit.tau, 2, axis=0)) for fit in fits])
    noise = np.zeros_like(size)
    if len(differences):
        deviation = np.median(differences, axis=0) / float(stats.norm.ppf(0.75))
        # for filtered white noise: variance of second differences of rows over that of rows
        taps, step = used.taps, used.decimation
        own, next_one, after = (
            float(taps[: len(taps) - lag] @ taps[lag:]) if lag < len(taps) else 0.0
            for lag in (0, step, 2 * step)
        )
        noise = deviation / np.sqrt((6.0 * own - 8.0 * next_one + 2.0 * after) / own)
    share = np.divide(noise, size, out=np.zeros_like(size), where=size > 0.0)
    corrected = np.sqrt(np.maximum(np.square(errors) - 2.0 * np.square(100.0 * share), 0.0))
    return np.where(moving(fit.motion for fit in fits), corrected, 0.0)
