# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Search for the most likely mistake in a recording by a likelihood ratio.

Each hypothesis is compared with the data as recorded. Errors of the described links are more
common. Both fits therefore include the link parameters, with the description as prior. A mistake
is accepted if it explains more than fitted links do. This prior allows one wrong factor of all
masses; a factor of all torques is therefore also tested with the links as described.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import NamedTuple

from armid_ros.effects.slipping import Hysteresis
from armid_ros.effects.timing import smoothed, within_band
from armid_ros.identification.assess.grade_limits import LIMITS
from armid_ros.identification.assess.hypotheses import (
    AS_RECORDED,
    delayed,
    hypotheses,
    Hypothesis,
    shifted,
    WITHOUT_BODY,
)
from armid_ros.identification.assess.prediction_error import (
    prediction_error,
    PredictionError,
    root_mean_square,
    shared_values,
    thinned,
)
from armid_ros.identification.fitting.identifiability import near_deviation
from armid_ros.identification.rows.signals import (
    Conditioning,
    decimate,
    decimated_samples,
    segments,
)
from armid_ros.model import inverse_dynamics, regressor
from armid_ros.motion import FloatArray, Motion
from armid_ros.recording import Recording
from armid_ros.robots import Robot
import numpy as np

#: Smallest number of samples for a test.
_MIN_SAMPLES = 40


@dataclass(frozen=True)
class Mistake:
    """
    Mistake found in a recording, with torque errors before and after its correction.

    Attributes
    ----------
    hypotheses : tuple of Hypothesis
        Hypothesis with the largest likelihood ratio, and equally likely ones.
    before, after : PredictionError
        Torque errors of the data as recorded, and after correction of the mistake.
    fitted : bool
        Whether the link parameters were fitted as well.

    """

    hypotheses: tuple[Hypothesis, ...]
    before: PredictionError
    after: PredictionError
    fitted: bool

    @property
    def joint(self) -> int:
        """Return the index of the joint whose torque error the correction reduces most."""
        return int(np.argmax(self.before.joints.clip(max=1.0) - self.after.joints))

    @property
    def of_data(self) -> bool:
        """Whether only faulty data, and not a changed arm, would explain the torques."""
        return all(one.of_data for one in self.hypotheses)

    @property
    def text(self) -> str:
        """Return the mistake and its remedy as text, without a full stop."""
        return ', or '.join(one.text for one in self.hypotheses)

    def sentence(self, robot: Robot) -> str:
        """Return the mistake, its remedy and its torque errors as text, without a full stop."""
        before, after = (
            100.0 * min(float(error.joints[self.joint]), 9.99)
            for error in (self.before, self.after)
        )
        arm = 'fitted' if self.fitted else 'described'
        return (
            f'{self.text} (torque error of {robot.joints[self.joint]} with the {arm} arm: '
            f'{before:.0f} % as recorded, {after:.0f} % corrected)'
        )


def shared_mistakes(
    robot: Robot, recordings: Sequence[Recording], used: Conditioning, *, refit: bool = True
) -> list[tuple[Mistake, tuple[str, ...]]]:
    """
    Return the mistakes in recordings with torques, each with the recordings that contain it.

    Mistakes of one kind in one joint are grouped. The returned mistake is that of the recording
    with the largest torque error. Without `refit`, mistakes that only fitted links reveal are not
    returned.

    """
    by_kind: dict[tuple[object, ...], list[tuple[str, Mistake]]] = {}
    for recording in recordings:
        mistake = find_mistake(robot, recording, used, refit=refit)
        if mistake is not None:
            kind = (mistake.hypotheses[0].kind, *mistake.hypotheses[0].where)
            by_kind.setdefault(kind, []).append((recording.source, mistake))
    return [
        (
            max((one for _, one in found), key=lambda one: float(one.before.joints.max())),
            tuple(source for source, _ in found),
        )
        for found in by_kind.values()
    ]


class _Tested(NamedTuple):
    """Tested hypothesis: torque errors, and likelihood ratios relative to their limits."""

    hypothesis: Hypothesis
    described: PredictionError  # with the described links
    as_described: float
    fitted: PredictionError  # with fitted links
    as_fitted: float


def find_mistake(
    robot: Robot, recording: Recording, used: Conditioning, *, refit: bool = True
) -> Mistake | None:
    """
    Return the most likely mistake in a recording with torques; None if there is none.

    None if the data as recorded fit best, or if errors of the link parameters may be the cause.
    Without `refit`, mistakes that only fitted links reveal are not returned. The data are filtered
    as for the identification.

    """
    slow = slow_motions([recording], used)
    near, described, bare = (
        _error(robot, slow, one, near=fitted)
        for one, fitted in ((AS_RECORDED, True), (AS_RECORDED, False), (WITHOUT_BODY, False))
    )
    if near is None or described is None or bare is None:
        return None
    without = replace(described, joints=np.minimum(described.joints, bare.joints))
    # whether the residual with fitted links alone is large enough to reveal a mistake
    alone = refit and bool(100.0 * near.joints.max() >= LIMITS.poor)
    exact = PredictionError(np.zeros(robot.n_joints), without.torque)
    if without.gain(exact) < LIMITS.gain and not alone:
        return None

    def rows(tested: Sequence[Hypothesis]) -> list[_Tested]:
        """Return tests of hypotheses; fit links too if link errors may change the decision."""
        found = []
        for one in tested:
            after = _error(robot, slow, one, near=False)
            if after is None:
                continue
            price, fitted = LIMITS.gain**one.values, near
            ratio = without.gain(after) / price
            # fitted links can explain any factor of a torque
            if ratio >= 1.0 or (alone and one.kind != 'unit' and not one.of_masses):
                fitted = _error(robot, slow, one, near=True) or near
            found.append(_Tested(one, after, ratio, fitted, near.gain(fitted) / price))
        return found

    delay = torque_delay(robot, recording, used)
    tried = rows([*hypotheses(robot, slow), *([] if delay is None else [delayed(*delay)])])
    for ratio in ('as_described', 'as_fitted'):
        tried += rows(max(tried, key=attrgetter(ratio)).hypothesis.nearby())
    # hypotheses with which the model predicts the corrected data
    after = (row.described if row.as_described >= 1.0 else row.fitted for row in tried)
    errors = [100.0 * one.overall(robot) for one in after]
    tried = [row for row, error in zip(tried, errors, strict=True) if error < LIMITS.unusable]
    # prefer hypotheses that explain more than any body near the description
    sure = [row for row in tried if row.as_described >= 1.0]
    both = [row for row in sure if row.as_fitted >= 1.0]
    if both:
        return _most_likely(both, 'as_described', described)
    # the data have to be likelier too: links that absorb a missing effect leave their prior
    price = LIMITS.gain ** (LIMITS.free_body - 1.0)
    changes = [
        row
        for row in tried
        if row.hypothesis.kind != 'unit'
        and not row.hypothesis.of_masses
        and row.as_fitted >= price
        and near.of_data(row.fitted) >= LIMITS.gain**row.hypothesis.values
    ]
    if changes and alone:
        return _most_likely(changes, 'as_fitted', near)
    masses = [row for row in sure if row.hypothesis.of_masses]
    return _most_likely(masses, 'as_described', described) if masses else None


def _error(
    robot: Robot, slow: Sequence[Motion], hypothesis: Hypothesis, *, near: bool
) -> PredictionError | None:
    """Return the torque error after the correction of a hypothesis; None for too few samples."""
    # 200 samples: twenty for each of the ten parameters of a link
    motion = thinned([hypothesis.motion(motion) for motion in slow], 200)
    if motion is None or len(motion) < _MIN_SAMPLES:
        return None
    return prediction_error(hypothesis.body(robot), motion, near=near)


def _most_likely(rows: Sequence[_Tested], ratio: str, before: PredictionError) -> Mistake:
    """Return the most likely mistake, with mistakes of other kinds that are about as likely."""
    value = attrgetter(ratio)
    first, *others = sorted(rows, key=value, reverse=True)
    likely = {first.hypothesis.kind: first.hypothesis}
    for row in others:
        more = LIMITS.gain ** (row.hypothesis.values - first.hypothesis.values + 0.5)
        if value(row) * more > value(first):
            likely.setdefault(row.hypothesis.kind, row.hypothesis)
    fitted = ratio == 'as_fitted'
    after = first.fitted if fitted else first.described
    return Mistake(tuple(likely.values()), before, after, fitted)


def slow_motions(recordings: Sequence[Recording], used: Conditioning) -> list[Motion]:
    """Return gap-free sections of recordings, low-passed to the frequencies of the motion."""
    result = []
    for motion in (part for one in recordings for part in segments(one, used)):
        kept = np.array(decimated_samples(len(motion), used), dtype=np.intp)
        assert motion.tau is not None
        slow, tau = motion.select(kept), decimate(motion.tau, used)
        if len(slow) >= _MIN_SAMPLES:
            parts = (within_band(slow, x) for x in (slow.q, slow.dq, slow.ddq, tau))
            result.append(Motion(slow.joints, slow.t, *parts))
    return result


class Delay(NamedTuple):
    """Delay of a torque, negative if early, and half-width of its 95 % interval [s]."""

    seconds: float
    half_width: float


def torque_delay(robot: Robot, recording: Recording, used: Conditioning) -> Delay | None:
    """
    Return the delay of torques behind positions; None if its 95 % interval includes zero.

    A delay shifts the whole torque in time. Presliding friction delays only the friction: after a
    reversal it grows with the distance that the joint has travelled (Dahl 1968), which takes tens
    of milliseconds at low speed. A delay is therefore estimated from weight and inertia. Its
    column is the rate of the rigid-body torque; friction with several presliding lengths is a
    nuisance parameter. In a reversed motion, the rigid-body torque is the same, but its rate and
    friction have the opposite sign. Errors of described masses therefore do not look like a delay.

    """
    longest = 0.3  # longest delay that is tested [s]
    stretches = list(segments(recording, used))
    seconds, half = 0.0, np.inf
    for _ in range(10):  # Gauss-Newton steps
        moved = [shifted(motion, seconds) for motion in stretches] if seconds else stretches
        # the rate needs two samples
        rows = [
            _delay_rows(robot, x, used) for x in moved if len(decimated_samples(len(x), used)) > 1
        ]
        if not rows:
            return None
        own, near, shared, tau = (np.concatenate(part, axis=1) for part in zip(*rows, strict=True))
        own = own / root_mean_square(own.transpose(1, 0, 2))[:, np.newaxis]
        torque = root_mean_square(tau.T)[:, np.newaxis, np.newaxis]
        (step,), (half,) = shared_values(own, shared / torque, near / torque)
        before = seconds
        seconds = float(np.clip(seconds + step, -longest, longest))
        # a smaller step [s], or a small share of the interval, changes no decision
        if abs(seconds - before) < max(1e-4, 0.05 * half):
            break
    return Delay(seconds, float(half)) if abs(seconds) > half else None


def _delay_rows(robot: Robot, motion: Motion, used: Conditioning) -> tuple[FloatArray, ...]:
    """Return regressors of nuisance, link and delay parameters, (n, M, k), and torques (n, M)."""
    # presliding lengths of friction [rad or m], as in gears of arms, in steps of three to cover
    # all lengths between. On 63 recordings with lengths of 1 to 3 mrad, the delay errs by -1 to 6
    # ms (5 to 95 %). Lengths of 1 and 3 mrad alone err by 0 to 6 ms, 0.1 to 30 mrad by -3 to 6 ms.
    # Without lengths, the error is -24 to 17 ms, with a six times wider interval.
    lengths = (0.0003, 0.001, 0.003, 0.01)
    # own columns: offset, viscous friction, drive inertia, and dry friction without and with
    # presliding, constant and in proportion to the load; it is filtered as the torque is, as it
    # steps within a sample
    assert motion.tau is not None
    n, kept = motion.n_joints, np.array(decimated_samples(len(motion), used), dtype=np.intp)
    slow = motion.select(kept)
    elements = [Hysteresis(np.eye(n), np.ones(n), np.full(n, length)) for length in lengths]
    states = (one.along(motion.q, motion.dq) for one in elements)
    tau, *dry = (
        within_band(slow, decimate(x, used)) for x in (motion.tau, np.sign(motion.dq), *states)
    )
    slow = smoothed(slow)
    body = inverse_dynamics(robot, slow)
    loaded = [np.abs(body) * part for part in dry]
    own = np.stack([np.ones_like(body), slow.dq, slow.ddq, *dry, *loaded], axis=-1)
    near = regressor(robot, slow) * near_deviation(robot)
    rate = np.gradient(body, slow.t, axis=0)
    shared = np.stack([-rate, tau - body], axis=-1)
    return *(one.transpose(1, 0, 2) for one in (own, near, shared)), tau.T
