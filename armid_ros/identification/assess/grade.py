# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
What an identification is good for, in one word, and why.

The word follows the torque error on data that were not fitted, of the joint that is predicted
worst, and what the recordings show to be wrong with them. Errors of joints are shares of their own
torque: a slide takes newtons and a wrist newton metres, and their sum has no unit. No model
predicts white noise of a torque, or where in its dry friction a joint is that rests.

"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from armid_ros.arm import ArmModel
from armid_ros.identification.assess.data_faults import sensor_faults
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.joint_units import units_beyond_drives
from armid_ros.identification.assess.mistakes import Mistake, suspected_mistake
from armid_ros.identification.assess.undriven import held_elsewhere
from armid_ros.identification.assess.velocities import velocity_faults
from armid_ros.identification.identify import Identification
from armid_ros.identification.rows.checks import moving
from armid_ros.identification.rows.regression import Fit, Score
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.identification.rows.stamps import rounded_stamps
from armid_ros.motion import FloatArray
from armid_ros.recording import Recording
import numpy as np
from scipy import stats

Word = Literal['good', 'poor', 'unusable']
_WORDS: tuple[Word, ...] = ('good', 'poor', 'unusable')


@dataclass(frozen=True)
class Grade:
    """
    What an identification is good for.

    Attributes
    ----------
    word : {'good', 'poor', 'unusable'}
        The worst that any reason says.
    reasons : tuple of str
        Why, the worst first; one at least.
    faults : tuple of str
        What the recordings themselves show to be wrong, the worst first, without a full stop.

    """

    word: Word
    reasons: tuple[str, ...]
    faults: tuple[str, ...] = ()

    def document(self) -> dict[str, object]:
        """Return the grade for programs to read."""
        return {'grade': self.word, 'reasons': list(self.reasons)}


class _Reason(NamedTuple):
    word: Word
    text: str


def grade(
    result: Identification,
    description: ArmModel,
    recordings: Sequence[Recording],
    validation: Mapping[str, Sequence[Fit]],
    held_out: Sequence[Recording] = (),
) -> Grade:
    """
    Grade an identification.

    Parameters
    ----------
    result : Identification
        What was found.
    description : ArmModel
        The model before it.
    recordings : sequence of Recording
        What it was fitted to.
    validation : mapping of str to sequence of Fit
        Predictions of recordings that were not used for fitting, by recording.
    held_out : sequence of Recording
        Those recordings.

    """
    robot, every = description.robot, [*recordings, *held_out]
    fits = [*result.training, *(fit for part in validation.values() for fit in part)]
    motions = {
        one.source: [fit.motion for fit in fits if fit.source == one.source] for one in every
    }
    used = result.used
    band_hz = min(used.kept_hz, *(fit.motion.band_hz for fit in result.training))
    sensors = list(sensor_faults(description, every, motions, used.cutoff_hz, band_hz))
    # what else a recording with a dead sensor seems to show is of that
    blind = {fault.source for fault in sensors if fault.fatal}
    seeing = [one for one in every if one.source not in blind]
    mistakes, suspicions = _mistakes(result, description, seeing)
    moved = [fit.motion for fit in fits]
    units = [] if mistakes else units_beyond_drives(robot, seeing, moved)
    faults = [
        *(_Reason('unusable' if fault.fatal else 'poor', fault.text) for fault in sensors),
        *mistakes,
        *(_Reason('poor', text) for text in units),
        *(
            _Reason('poor' if found.spoils else 'good', found.text)
            for found in held_elsewhere(robot, every, moved)
        ),
    ]
    reasons = [
        *faults,
        *_errors(result, validation),
        *_resting(result, validation),
        *_clocks(every),
        *_velocities(every),
        *suspicions,
    ]
    ordered = _worst_first(reasons)
    return Grade(
        ordered[0].word,
        tuple(f'{reason.text[0].upper()}{reason.text[1:]}.' for reason in ordered),
        tuple(fault.text for fault in _worst_first(faults) if fault.word != 'good'),
    )


def _worst_first(reasons: Sequence[_Reason]) -> list[_Reason]:
    return sorted(reasons, key=lambda reason: -_WORDS.index(reason.word))


def by_error(error: float) -> Word:
    """Return the grade of a relative torque error on data that were not fitted [%]."""
    return 'good' if error <= LIMITS.poor else 'poor' if error <= LIMITS.unusable else 'unusable'


def _mistakes(
    result: Identification, description: ArmModel, recordings: Sequence[Recording]
) -> tuple[list[_Reason], list[_Reason]]:
    """Return what recordings show to be wrong, and what links explain as well, which is a note."""
    # Zeros and names are those of a day: what one recording of several suggests is of its motion.
    robot = description.body
    alike: dict[tuple[object, ...], list[tuple[str, Mistake]]] = {}
    for recording in recordings:
        mistake = suspected_mistake(robot, recording, result.used)
        if mistake is not None:
            kind = (mistake.links, mistake.hypotheses[0].kind, *mistake.hypotheses[0].where)
            alike.setdefault(kind, []).append((recording.source, mistake))
    mistakes, suspicions = [], []
    for found in alike.values():
        worst = max((mistake for _, mistake in found), key=lambda m: float(m.before.joints.max()))
        where = ', '.join(dict.fromkeys(source for source, _ in found))
        text = worst.sentence(robot)
        if len(found) < len(recordings):
            text = f'in {where}: {text}'
        error = 100.0 * float(worst.before.joints[worst.joint])
        certain = error > LIMITS.unusable and not worst.hypotheses[0].disputable
        if worst.links and len(found) == len(recordings):
            suspicions.append(_Reason('good', text))
        elif not worst.links:
            mistakes.append(_Reason('unusable' if certain else 'poor', text))
    return mistakes, suspicions


def _errors(result: Identification, validation: Mapping[str, Sequence[Fit]]) -> Iterator[_Reason]:
    for bag, fits in validation.items():
        worst = _Worst.of(Score.of(fits).joint_relative_error_percent, fits, result)
        word = by_error(worst.error)
        use = {
            'good': '',
            'poor': ', too much to compute torques with',
            'unusable': ', the model does not describe this motion',
        }
        text = f'torque error on {bag}, held out: {worst.said}{use[word]}'
        yield _Reason(word, text)
    if not validation:
        yield _halves(result)
    # what was held out, or what was fitted where nothing was
    fits = [fit for part in validation.values() for fit in part] or list(result.training)
    every = Score.of(fits).joint_relative_error_percent
    if np.all(every[moving(fit.motion for fit in fits)] > LIMITS.unusable):
        yield _Reason('unusable', f'the torque of no joint is predicted to {LIMITS.unusable:g} %')
        return
    noisy = every - beyond_noise(every, fits, result.used) > LIMITS.unusable
    if np.any(noisy):
        named = ', '.join(
            f'{result.arm.robot.joints[j]} ({every[j]:.0f} %)' for j in np.flatnonzero(noisy)
        )
        text = f'the torque is hardly predicted of {named}, where it is noise or friction at rest'
        yield _Reason('good', text)


class _Worst(NamedTuple):
    """The joint that is predicted worst: its error beyond noise [%], and its error in words."""

    error: float
    said: str

    @classmethod
    def of(cls, errors: FloatArray, fits: Sequence[Fit], result: Identification) -> _Worst:
        """Choose it among errors of joints as shares of their torque, shape (n,) [%]."""
        joints, beyond = result.arm.robot.joints, beyond_noise(errors, fits, result.used)
        moves = moving(fit.motion for fit in fits)
        largest = worst = int(np.argmax(np.where(moves, errors, -1.0)))
        error = float(beyond.max())
        if by_error(error) != by_error(errors[largest]):  # most of the largest error is noise
            worst = int(np.lexsort((errors, beyond))[-1])
        said = f'{errors[worst]:.3g} %'
        details = []
        if by_error(error) != by_error(errors[worst]):
            details.append(f'{error:.3g} % without noise')
        if len(joints) > 1:
            details.append(
                f'worst joint: {joints[worst]}{"" if worst == largest else " beyond noise"}'
            )
        return cls(error, f'{said} ({", ".join(details)})' if details else said)


def _halves(result: Identification) -> _Reason:
    """Judge by what one half of the data says of the other, where nothing was held out."""
    training = Score.of(result.training).joint_relative_error_percent
    every = result.halves.joints
    worst = _Worst.of(every, result.training, result)
    word = by_error(worst.error)
    text = f'cross-check between the halves of the data: {worst.said}'
    undetermined = every > np.maximum(LIMITS.undetermined * training, 100.0 * LIMITS.floor)
    undetermined &= beyond_noise(every, result.training, result.used) > 0.0
    if np.any(undetermined):
        joint = int(np.argmax(np.where(undetermined, every, 0.0)))
        word = 'poor' if word == 'good' else word
        time = sum(float(fit.motion.t[-1] - fit.motion.t[0]) for fit in result.training)
        text += (
            f', but the training error of {result.arm.robot.joints[joint]} is '
            f'{training[joint]:.2g} %: {time:.2g} s of this motion do not determine '
            f'{result.base.rank} parameters; record longer, or move more'
        )
    return _Reason(word, text)


def _resting(result: Identification, validation: Mapping[str, Sequence[Fit]]) -> list[_Reason]:
    """Say which joints nothing is known of, or are not checked, because they do not move."""
    fitted = moving(fit.motion for fit in result.training)
    held_out = [fit.motion for part in validation.values() for fit in part]
    checked = moving(held_out) if held_out else fitted
    joints = np.array(result.arm.robot.joints)
    reasons = []
    if not np.all(fitted):
        names, others = ', '.join(joints[~fitted]), ','.join(joints[fitted])
        text = (
            f'not identified and not checked, as they do not move: {names}; record a motion of '
            f'all joints, or ask for the others alone with --joints {others}'
        )
        reasons.append(_Reason('poor', text))
    if np.any(fitted & ~checked):
        names = ', '.join(joints[fitted & ~checked])
        text = f'not checked, as they do not move in what was held out: {names}'
        reasons.append(_Reason('good', text))
    return reasons


def _velocities(recordings: Sequence[Recording]) -> Iterator[_Reason]:
    """Say whose recorded velocities are not those of the positions, which alone were used."""
    alike: dict[str, list[str]] = {}
    for recording in recordings:
        for text in velocity_faults(recording):
            alike.setdefault(text, []).append(recording.source or 'a recording')
    for text, sources in alike.items():
        where = '' if len(sources) == len(recordings) else f'in {", ".join(sources)}, '
        yield _Reason('good', f'{where}{text}; the fit takes velocities from the positions')


def _clocks(recordings: Sequence[Recording]) -> Iterator[_Reason]:
    """Say of which recordings stamps jumped back, or are rounded."""
    for recording in recordings:
        report = recording.report
        if report.restarted:
            text = (
                f'the clock of {recording.source} jumped back; {report.restarted} of '
                f'{report.messages} messages, on the shorter side of it, are left out'
            )
            yield _Reason('good', text)
        rounded = rounded_stamps(recording)
        if rounded:
            yield _Reason('good', f'in {recording.source or "a recording"} {rounded}')


def beyond_noise(errors: FloatArray, fits: Sequence[Fit], used: Conditioning) -> FloatArray:
    """
    Return what is left of errors of joints without the noise of their torques.

    Noise counts twice: a row has it, and so has the prediction of a row, where that is as sure as
    a measurement of it (leverage of one, Hoaglin and Welsch 1978). A model that is no further off
    than a sensor is not what is wrong.

    Parameters
    ----------
    errors : ndarray, shape (n,)
        Norm of the residual of each joint over that of its torque [%].
    fits : sequence of Fit
        Where they come from.
    used : Conditioning
        Filters of the rows.

    Returns
    -------
    ndarray, shape (n,)
        The same without the noise [%]; zero of a joint that rests throughout.

    """
    told = np.concatenate([fit.informative for fit in fits])
    torque = told * np.concatenate([fit.tau for fit in fits])
    rows = np.maximum(np.count_nonzero(told, axis=0), 1)
    size = np.sqrt(np.sum(torque**2, axis=0) / rows)
    noise = np.divide(torque_noise(fits, used), size, out=np.zeros_like(size), where=size > 0.0)
    left = np.sqrt(np.maximum(np.square(errors) - 2.0 * np.square(100.0 * noise), 0.0))
    return np.where(moving(fit.motion for fit in fits), left, 0.0)


def torque_noise(fits: Sequence[Fit], used: Conditioning) -> FloatArray:
    """
    Return the standard deviation of the white noise in rows of measured torque, (n,) [N m].

    It shows in second differences (Gasser, Sroka and Jennen-Steinmetz 1986), whose deviation is
    taken from their median: what the motion makes of a torque changes little from row to row, and
    friction steps in few of them.

    """
    parts = [np.abs(np.diff(fit.tau, 2, axis=0)) for fit in fits]
    differences = np.concatenate(parts)
    if not len(differences):
        return np.zeros(fits[0].motion.n_joints)
    deviation = np.median(differences, axis=0) / float(stats.norm.ppf(0.75))
    # the variance of second differences of rows over that of rows, of white noise
    taps, step = used.taps(), used.decimation
    own, next_one, after = (
        float(taps[: len(taps) - lag] @ taps[lag:]) if lag < len(taps) else 0.0
        for lag in (0, step, 2 * step)
    )
    return np.asarray(deviation / np.sqrt((6.0 * own - 8.0 * next_one + 2.0 * after) / own))
