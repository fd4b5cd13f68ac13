# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Which mistake a recording shows, if any.

Hypotheses are tried one by one, where the arm as described predicts the recording badly enough
for one of them to matter. Links that are off as those of descriptions are may be the cause too,
and are the commoner one: a mistake is believed if it explains what no such body does. Where none
is believed and the prediction fails, hypotheses are tried once more with such a body alone.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from armid_ros.effects.timing import within_band
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.hypotheses import (
    AS_RECORDED,
    delayed,
    hypotheses,
    Hypothesis,
    other_scale,
    WITHOUT_BODY,
)
from armid_ros.identification.assess.late_torque import late_torque
from armid_ros.identification.assess.prediction_error import (
    described_error,
    nearest_error,
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

#: Samples of a recording that are looked at: a hundred and more for every value that is fitted to
#: the torque of a joint, and ten and more where the body is fitted too.
_ROWS, _ROWS_FITTED = 600, 200
#: The middle of a recording that tells what is usual of it, in percent.
_USUAL = (1.0, 99.0)
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


def suspected_mistake(robot: Robot, recording: Recording, used: Conditioning) -> Mistake | None:
    """Return what `find_mistake` does, or else what links that are off explain as well."""
    slow = slow_motions([recording], used)
    if sum(len(motion) for motion in slow) < _FEWEST:
        return None
    tried = list(hypotheses(robot, slow))
    late = late_torque(robot, recording, used)
    tried += [] if late is None else [delayed(*late)]
    faulty = faulty_samples(robot, recording, used)
    tried += [] if faulty is None else [faulty]
    described, fitted = (_judge(robot, slow, fitted=fitted) for fitted in (False, True))
    found = _best(robot, tried, described, fitted)
    if found is not None:
        likely = (one.detailed(slow) if one.detailed else one for one in found.hypotheses)
        found = replace(found, hypotheses=tuple(likely))
    if found is not None and not found.links:
        return found
    for judge in (described, fitted):
        as_recorded = judge(AS_RECORDED)
        # data that are predicted as they were recorded, or are too few to ask
        if as_recorded is None or 100.0 * float(as_recorded[0].joints.max()) < LIMITS.poor:
            return found
    changes = [one for one in tried if one.kind != 'unit' and not one.of_masses]
    return _best(robot, changes, fitted) or found


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


def effort_factor(robot: Robot, slow: Sequence[Motion]) -> float | None:
    """
    Return how many times what is described the efforts of motions are, all joints together.

    Friction, offset and drive inertia of each joint are fitted beside it. None where motion is
    too short, or the efforts do not follow the description with any factor.

    """
    found = _judge(robot, slow)(other_scale(robot))
    if found is None or 100.0 * found[0].whole(robot) > LIMITS.unusable:
        return None
    factor = float(found[0].shared[0])
    return factor if factor > 0.0 else None


def is_factor(robot: Robot, slow: Sequence[Motion], factor: float) -> bool:
    """Whether efforts are so many times what is described: the one that fits leaves no less."""
    converted = [one.with_torque(one.tau / factor) for one in slow if one.tau is not None]
    free, fixed = (
        _judge(robot, motions)(hypothesis)
        for motions, hypothesis in ((slow, other_scale(robot)), (converted, AS_RECORDED))
    )
    return free is not None and fixed is not None and fixed[0].gain(free[0]) < LIMITS.gain**0.5


def _judge(robot: Robot, slow: Sequence[Motion], *, fitted: bool = False) -> Judge:
    """Return what predicts data with the body as described, or with the nearest that fits."""

    def judge(one: Hypothesis) -> tuple[PredictionError, Hypothesis] | None:
        motion = thinned(one.stretches(slow), _ROWS_FITTED if fitted else _ROWS)
        if motion is None or len(motion) < _FEWEST:
            return None
        if fitted:
            return nearest_error(robot, motion), one
        error = described_error(motion, *one.torque(robot, motion))
        return error, one.settled(error.shared) if one.settled else one

    return judge


def _best(
    robot: Robot, tried: Sequence[Hypothesis], judge: Judge, near: Judge | None = None
) -> Mistake | None:
    """Return the hypothesis that gains most, if that is enough for what it is free to choose."""
    # Beside a judge by the body as described, another one by bodies near it says which are of
    # links.
    as_recorded = judge(AS_RECORDED)
    if as_recorded is None:
        return None
    before, fitted = as_recorded[0], near is None
    nothing = None if fitted else judge(WITHOUT_BODY)
    rival = before if nothing is None else before.least(nothing[0])
    price = LIMITS.gain if not fitted else LIMITS.gain**LIMITS.free_body
    if rival.best_gain() < price:
        return None
    rows = _judged(tried, judge, rival, price)
    if not rows:
        return None
    nearest = max(rows, key=lambda row: row.surplus)
    rows += _judged(nearest.hypothesis.nearby(), judge, rival, price)
    believed = [
        row
        for row in rows
        if row.surplus >= 1.0
        and 100.0 * row.after.whole(robot) < LIMITS.unusable
        and before.of_data(row.after) >= 1.0  # not only a body that is nearer
    ]
    if not believed:
        return None
    sure = believed
    likeliest = None if near is None else near(AS_RECORDED)
    if near is not None and likeliest is not None:
        # where the centre of a wrist lies near its axis, a few millimetres turn its weight by as
        # much as a wrong zero; a factor of all masses is none where it is material
        def beyond_bodies(one: Hypothesis) -> bool:
            put_right = None if one.of_masses else near(one)
            if put_right is None:
                return True
            return likeliest[0].gain(put_right[0]) >= LIMITS.gain**one.values

        sure = [row for row in believed if beyond_bodies(row.hypothesis)]
        believed = sure or believed
    first = max(believed, key=lambda row: row.surplus)
    as_good = {
        row.hypothesis.kind: row.hypothesis
        for row in sorted(believed, key=lambda row: row.gain)
        if row.hypothesis.kind != first.hypothesis.kind
        and row.gain * LIMITS.gain**0.5 > first.gain
    }
    likely = (first.hypothesis, *as_good.values())
    return Mistake(likely, before, first.after, fitted, links=not sure)


class _Row(NamedTuple):
    """A hypothesis, how far it divides the error, and that over what it has to."""

    hypothesis: Hypothesis
    after: PredictionError
    gain: float
    surplus: float


def _judged(
    tried: Sequence[Hypothesis],
    judge: Judge,
    rival: PredictionError,
    price: float,
) -> list[_Row]:
    rows = []
    for one in tried:
        pair = judge(one)
        if pair is not None and pair[1].material:
            after, settled = pair
            gain = rival.gain(after)
            rows.append(_Row(settled, after, gain, gain / price**settled.values))
    return rows


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
