# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which mistake a recording shows, if any.

Hypotheses are tried one by one, where the arm as described predicts the recording badly enough
for one of them to matter; where none is believed and the prediction fails, once more with a body
that is fitted too.

"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from armid_ros.effects.timing import within_band
from armid_ros.identification.grade_limits import LIMITS
from armid_ros.identification.hypotheses import AsRecorded, hypotheses, Hypothesis
from armid_ros.identification.prediction_error import (
    described_error,
    fitted_error,
    PredictionError,
)
from armid_ros.motion import Motion
from armid_ros.robots import Robot
import numpy as np

#: Samples of a recording that are looked at; twenty values for each of thirty free ones.
_ROWS, _ROWS_FITTED = 600, 300
#: Samples below which nothing can be asked.
_FEWEST = 40

Judge = Callable[[Hypothesis], tuple[PredictionError, Hypothesis] | None]


@dataclass(frozen=True)
class Mistake:
    """
    What a recording shows to be wrong with it.

    Attributes
    ----------
    hypotheses : tuple of Hypothesis
        The one that explains most, and those that explain as much.
    before, after : PredictionError
        As recorded, and with the mistake put right.
    fitted : bool
        Whether the body had to be fitted to see it.

    """

    hypotheses: tuple[Hypothesis, ...]
    before: PredictionError
    after: PredictionError
    fitted: bool

    @property
    def joint(self) -> int:
        """The joint whose prediction gains most."""
        return int(np.argmax(self.before.joints.clip(max=1.0) / self.after.joints))

    def sentence(self, robot: Robot) -> str:
        """Say what seems to be wrong, what to do and what shows it, without a full stop."""
        said = ', or '.join(one.sentence(robot) for one in self.hypotheses)
        before, after = (
            100.0 * min(float(error.joints[self.joint]), 9.99)
            for error in (self.before, self.after)
        )
        arm = 'fitted' if self.fitted else 'described'
        return (
            f'{said} (the arm as {arm} predicts the torque of {robot.joints[self.joint]} to '
            f'{before:.0f} % as recorded, to {after:.0f} % with that put right)'
        )


def find_mistake(
    robot: Robot, stretches: Sequence[Motion], suspects: Sequence[Hypothesis] = ()
) -> Mistake | None:
    """
    Try what may be wrong with a recording.

    Parameters
    ----------
    robot : Robot
        The description.
    stretches : sequence of Motion
        The recording, filtered and decimated, with torques.
    suspects : sequence of Hypothesis
        What this recording suggests beside what any may have.

    Returns
    -------
    Mistake or None
        None where the data are best as they are.

    """
    slow = [_slow(motion) for motion in stretches]
    if sum(len(motion) for motion in slow) < _FEWEST:
        return None
    tried = [*suspects, *hypotheses(robot)]
    found = _best(robot, tried, _described(robot, slow), 1.0, fitted=False)
    if found is not None:
        return found
    before = fitted_error(robot, _thinned(slow, _ROWS_FITTED))
    if 100.0 * before.whole < LIMITS.poor and 100.0 * before.joints.max() < LIMITS.unusable:
        return None
    linear = [one for one in tried if one.torque is Hypothesis.torque]
    linear = [one for one in tried if type(one).torque is Hypothesis.torque]
    return _best(robot, linear, _fitted(robot, slow), LIMITS.free_body, fitted=True)


def _described(robot: Robot, slow: Sequence[Motion]) -> Judge:
    def judge(one: Hypothesis) -> tuple[PredictionError, Hypothesis] | None:
        motion = _thinned([one.motion(part) for part in slow], _ROWS)
        if len(motion) < _FEWEST:
            return None
        error = described_error(motion, *one.torque(robot, motion))
        return error, one.settled(error.shared)

    return judge


def _fitted(robot: Robot, slow: Sequence[Motion]) -> Judge:
    def judge(one: Hypothesis) -> tuple[PredictionError, Hypothesis] | None:
        motion = _thinned([one.motion(part) for part in slow], _ROWS_FITTED)
        return None if len(motion) < _FEWEST else (fitted_error(robot, motion), one)

    return judge


def _best(
    robot: Robot, tried: Sequence[Hypothesis], judge: Judge, price: float, *, fitted: bool
) -> Mistake | None:
    """Return the hypothesis that gains most, if that is enough for what it is free to choose."""
    as_recorded = judge(AsRecorded())
    assert as_recorded is not None
    before = as_recorded[0]
    least = LIMITS.gain**price
    if before.best_gain() < least:
        return None
    judged = list(_judged(robot, tried, judge))
    if not judged:
        return None
    nearest = max(judged, key=lambda pair: before.gain(pair[0]) / least ** pair[1].values)
    judged += _judged(robot, list(nearest[1].nearby()), judge)
    gains = [before.gain(error) / least**one.values for error, one in judged]
    believed = [
        (gain * least**one.values, error, one)
        for gain, (error, one) in zip(gains, judged, strict=True)
        if gain >= 1.0 and 100.0 * error.whole < LIMITS.unusable
    ]
    if not believed:
        return None
    _, after, first = max(believed, key=lambda row: row[0] / least ** row[2].values)
    most = max(gain for gain, _, _ in believed)
    equal = [
        one for gain, _, one in believed if LIMITS.gain**0.5 * gain > most and one != first
    ]
    kinds = {type(one): one for one in reversed(equal) if type(one) is not type(first)}
    return Mistake((first, *kinds.values()), before, after, fitted)


def _judged(
    robot: Robot, tried: Sequence[Hypothesis], judge: Judge
) -> Iterator[tuple[PredictionError, Hypothesis]]:
    for one in tried:
        pair = judge(one)
        if pair is not None and pair[1].material(robot, LIMITS):
            yield pair


def _slow(motion: Motion) -> Motion:
    """Keep of a motion and its torque what is in the band of the motion."""
    if len(motion) < _FEWEST:
        return motion
    parts = (within_band(motion, x) for x in (motion.q, motion.dq, motion.ddq, motion.tau))
    q, dq, ddq, tau = parts
    return replace(motion, q=q, dq=dq, ddq=ddq, tau=tau)


def _thinned(stretches: Sequence[Motion], rows: int) -> Motion:
    """Put stretches one after the other, and keep some of the samples."""
    arrays = [
        np.concatenate([getattr(part, name) for part in stretches])
        for name in ('t', 'q', 'dq', 'ddq', 'tau')
    ]
    step = max(1, len(arrays[0]) // rows)
    return Motion(stretches[0].joints, *(array[::step] for array in arrays))
