# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which mistake a recording shows, if any: hypotheses by their likelihood ratio.

Each is compared with the data as they were recorded. Links that are off as those of descriptions
may be are the commoner cause, and so the body is fitted with that prior in both: a mistake is
accepted if it explains what no such body does. Masses that are all off by one factor are within
that prior; a factor of all torques is therefore judged with the body as described, too.

"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import NamedTuple

from armid_ros.effects.timing import within_band
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.hypotheses import (
    AS_RECORDED,
    delayed,
    hypotheses,
    Hypothesis,
    WITHOUT_BODY,
)
from armid_ros.identification.assess.late_torque import late_torque
from armid_ros.identification.assess.prediction_error import (
    prediction_error,
    PredictionError,
    thinned,
)
from armid_ros.identification.rows.signals import (
    Conditioning,
    decimate,
    decimated_samples,
    GAP_PERIODS,
    segments,
)
from armid_ros.motion import Motion
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np
import numpy.typing as npt

#: Samples of a recording that are looked at: twenty for every value of a link.
_ROWS = 200
#: The middle of a recording that tells what is usual of it, in percent.
_USUAL = (1.0, 99.0)
#: Samples below which nothing can be asked.
_FEWEST = 40


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
        Whether the body was fitted, too.
    links : bool
        Whether links that are off as those of a description may be explain as much.

    """

    hypotheses: tuple[Hypothesis, ...]
    before: PredictionError
    after: PredictionError
    fitted: bool
    links: bool = False

    @property
    def joint(self) -> int:
        """Return the joint with most of the torque explained."""
        return int(np.argmax(self.before.joints.clip(max=1.0) - self.after.joints))

    def sentence(self, robot: Robot) -> str:
        """Say what seems to be wrong, what to do and what shows it, without a full stop."""
        text = ', or '.join(one.text for one in self.hypotheses)
        before, after = (
            100.0 * min(float(error.joints[self.joint]), 9.99)
            for error in (self.before, self.after)
        )
        if self.links:
            return (
                f'the arm as described predicts the torque of {robot.joints[self.joint]} to '
                f'{before:.0f} %; links that are off as those of a description may be explain '
                f'that, and this would do so too: {text}'
            )
        arm = 'fitted' if self.fitted else 'described'
        return (
            f'{text} (torque error of {robot.joints[self.joint]} with the {arm} arm: '
            f'{before:.0f} % as recorded, {after:.0f} % corrected)'
        )


def find_mistake(robot: Robot, recording: Recording, used: Conditioning) -> Mistake | None:
    """
    Try what may be wrong with a recording.

    Parameters
    ----------
    robot : Robot
        The description.
    recording : Recording
        Data with torques.
    used : Conditioning
        Filters that the recording is identified with.

    Returns
    -------
    Mistake or None
        None where the data are best as they are, or the links may be what is wrong.

    """
    found = suspected_mistake(robot, recording, used)
    return None if found is None or found.links else found


class _Row(NamedTuple):
    """A hypothesis, its errors, and its likelihood ratios over what its values have to reach."""

    hypothesis: Hypothesis
    described: PredictionError
    as_described: float
    fitted: PredictionError
    as_fitted: float

    def predicts(self, robot: Robot) -> bool:
        """Whether the corrected data are predicted at all."""
        after = self.described if self.as_described >= 1.0 else self.fitted
        return bool(100.0 * after.whole(robot) < LIMITS.unusable)


@dataclass(frozen=True)
class _Reference:
    """The data as they were recorded, to which hypotheses are compared."""

    robot: Robot
    slow: Sequence[Motion]
    near: PredictionError
    described: PredictionError
    without: PredictionError

    @staticmethod
    def of(robot: Robot, slow: Sequence[Motion]) -> _Reference | None:
        near = _error(robot, slow, AS_RECORDED, near=True)
        described = _error(robot, slow, AS_RECORDED, near=False)
        without = _error(robot, slow, WITHOUT_BODY, near=False)
        if near is None or described is None or without is None:
            return None
        return _Reference(robot, slow, near, described, described.least(without))

    @property
    def alone(self) -> bool:
        """Whether a fitted body alone leaves enough to show what is wrong."""
        return bool(100.0 * self.near.joints.max() >= LIMITS.poor)

    def rows(self, some: Iterable[Hypothesis]) -> Iterator[_Row]:
        """Judge hypotheses; a body is fitted where the described one leaves it open."""
        for one in (one for one in some if one.material):
            after = _error(self.robot, self.slow, one, near=False)
            if after is None:
                continue
            price, fitted = LIMITS.gain**one.values, self.near
            ratio = self.without.gain(after) / price
            if ratio >= 1.0 or (self.alone and one.of_motion):
                fitted = _error(self.robot, self.slow, one, near=True) or self.near
            yield _Row(one, after, ratio, fitted, self.near.gain(fitted) / price)

    def likeliest(self, rows: Sequence[_Row]) -> Mistake | None:
        """Return what explains most: more than any body near the description does, if it can."""
        rows = [row for row in rows if row.predicts(self.robot)]
        described = [row for row in rows if row.as_described >= 1.0]
        both = [row for row in described if row.as_fitted >= 1.0]
        if both:
            return _first(both, 'as_described', self.described)
        price = LIMITS.gain ** (LIMITS.free_body - 1.0)
        changes = [row for row in rows if row.hypothesis.of_motion and row.as_fitted >= price]
        changes = [row for row in changes if self.near.of_data(row.fitted) >= 1.0]
        if changes and self.alone:
            return _first(changes, 'as_fitted', self.near, fitted=True)
        masses = [row for row in described if row.hypothesis.of_masses]
        if masses:
            return _first(masses, 'as_described', self.described)
        if described and 100.0 * self.described.joints.max() >= LIMITS.poor:
            return replace(_first(described, 'as_described', self.described), links=True)
        return None


def suspected_mistake(robot: Robot, recording: Recording, used: Conditioning) -> Mistake | None:
    """Return what `find_mistake` does, or else what links that are off explain as well."""
    slow = slow_motions([recording], used)
    if sum(len(motion) for motion in slow) < _FEWEST:
        return None
    reference = _Reference.of(robot, slow)
    if reference is None:
        return None
    if reference.without.best_gain() < LIMITS.gain and not reference.alone:
        return None
    late, faulty = late_torque(robot, recording, used), faulty_samples(robot, recording, used)
    tried = [
        *hypotheses(robot, slow),
        *([] if late is None else [delayed(*late)]),
        *([] if faulty is None else [faulty]),
    ]
    rows = list(reference.rows(tried))
    for ratio in ('as_described', 'as_fitted') if rows else ():
        finer = max(rows, key=attrgetter(ratio)).hypothesis.nearby()
        rows += reference.rows(finer)
    return reference.likeliest(rows)


def _error(
    robot: Robot, slow: Sequence[Motion], one: Hypothesis, *, near: bool
) -> PredictionError | None:
    """Return how well a hypothesis predicts motions; None where too few samples remain."""
    motion = thinned(one.stretches(slow), _ROWS)
    if motion is None or len(motion) < _FEWEST:
        return None
    return prediction_error(one.body(robot), motion, near=near)


def _first(
    rows: Sequence[_Row], ratio: str, before: PredictionError, *, fitted: bool = False
) -> Mistake:
    """Return the hypothesis with the largest ratio, and those of other kinds that are as good."""
    value = attrgetter(ratio)
    first, *others = sorted(rows, key=value, reverse=True)
    likely = {first.hypothesis.kind: first.hypothesis}
    for row in others:
        more = LIMITS.gain ** (row.hypothesis.values - first.hypothesis.values + 0.5)
        if value(row) * more > value(first):
            likely.setdefault(row.hypothesis.kind, row.hypothesis)
    after = first.fitted if fitted else first.described
    return Mistake(tuple(likely.values()), before, after, fitted)


def faulty_samples(robot: Robot, recording: Recording, used: Conditioning) -> Hypothesis | None:
    """
    Find samples that no arm can have given: torques far out of the rest, positions that jump.

    Parameters
    ----------
    robot : Robot
        The description.
    recording : Recording
        Data with torques.
    used : Conditioning
        Filters that the recording is identified with.

    Returns
    -------
    Hypothesis or None
        The recording without them; None where there are none.

    """
    assert recording.tau is not None
    # where torques are further from what is usual than that spans, many times
    lower, upper = np.percentile(recording.tau, _USUAL, axis=0)
    excess = np.maximum(lower - recording.tau, recording.tau - upper)
    torque = np.asarray((excess > LIMITS.jump * (upper - lower)) & (upper > lower))
    # where positions have stepped faster than the joint ever moves, many times
    position = np.zeros(recording.q.shape, dtype=bool)
    if len(recording) > 1:
        time = np.maximum(np.diff(recording.t), recording.period)
        speed = np.abs(np.diff(recording.q, axis=0)) / time[:, np.newaxis]
        usual = np.percentile(speed, _USUAL[1], axis=0)
        position[1:] = (speed > LIMITS.jump * usual) & (usual > 0.0)
    at = np.argwhere(torque | position)
    if not len(at):
        return None
    row, joint = at[0]
    sound: npt.NDArray[np.bool_] = np.logical_not(torque.any(axis=1))
    width = int(GAP_PERIODS) + 1  # so much is missing around a jump that filters do not bridge it
    for jump in np.flatnonzero(position.any(axis=1)):
        sound[max(0, jump - width) : jump + width] = False
    name, t = recording.joints[joint], recording.t[row]
    if torque[row, joint]:
        unit = robot.torque_units[joint]
        first = f'the torque of {name} is {recording.tau[row, joint]:.3g} {unit} at {t:.3f} s'
    else:
        step = recording.q[row, joint] - recording.q[row - 1, joint]
        unit = robot.position_units[joint]
        first = f'the position of {name} jumps by {step:.3g} {unit} at {t:.3f} s'
    without = tuple(slow_motions([recording.select(sound)], used))
    count = len(np.unique(at[:, 0]))
    many = '' if count == 1 else f' (the first of {count})'
    text = f'{first}{many}: leave out what is faulty, or record again'
    return Hypothesis('samples', text, where=(text,), without=without)


def slow_motions(recordings: Sequence[Recording], used: Conditioning) -> list[Motion]:
    """Return the stretches of recordings, with what is in the band of the motion alone."""
    result = []
    for motion in (part for one in recordings for part in segments(one, used)):
        kept = np.array(decimated_samples(len(motion), used), dtype=np.intp)
        assert motion.tau is not None
        slow, tau = motion.select(kept), decimate(motion.tau, used)
        if len(slow) >= _FEWEST:
            parts = (within_band(slow, x) for x in (slow.q, slow.dq, slow.ddq, tau))
            result.append(Motion(slow.joints, slow.t, *parts))
    return result
