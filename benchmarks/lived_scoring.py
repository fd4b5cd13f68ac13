# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Comparison of answers about arms on two days with the truth, as rates with 95 % intervals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.metrics import Metric, number, rate
from benchmarks.two_days import Answer, Named
from tests.hidden.arrays import FloatArray
from tests.hidden.lived.arms import load_arm
from tests.hidden.lived.cases import LivedCase
from tests.hidden.lived.chain import Chain

#: Gap of a visible cause: its power equals the squared misfit of day 1.
VISIBLE = 1.0

#: Largest number of names in a useful tie.
LARGEST_TIE = 3

#: Other right names of a cause in the same joint, by the true name.
ALSO = {
    'payload': ('link_inertia',),
    'link_inertia': ('payload',),
    'gravity': ('base_tilt', 'gravity_magnitude'),
    'base_tilt': ('gravity',),
}

#: Right verdicts for causes outside of the catalogue.
ADMITTED = ('unknown', 'partial', 'not_repeatable')


@dataclass(frozen=True)
class LivedTruth:
    """
    A case without its recordings.

    Attributes
    ----------
    key, cause, size, style, arm : str
        Specification of the case.
    name : str
        Name of the cause in the catalogue; empty without a change.
    joints : tuple of str
        Joints of the cause.
    parameters : tuple of (name, joint, value)
        True values of the cause.
    in_catalogue : bool
        Whether the catalogue has the cause.
    gap : float
        Power of the cause over the squared misfit of day 1.
    share_of_power, share_of_excess : float
        Share of the cause in the squared held-out residual of the model of day 1, and in its
        excess over the misfit of day 1.
    gravity, described : ndarray, shape (3,)
        True and described gravity [m/s^2].
    friction : str
        Friction in the given model: unknown, values or names.
    felt : ndarray, shape (3, 3)
        Projection on the directions of gravity that affect torques: with parallel axes, gravity
        along them has no effect.

    """

    key: str
    cause: str
    size: str
    style: str
    arm: str
    name: str
    joints: tuple[str, ...]
    parameters: tuple[tuple[str, str, float], ...]
    in_catalogue: bool
    gap: float
    share_of_power: float
    share_of_excess: float
    gravity: FloatArray
    described: FloatArray
    friction: str = 'unknown'
    felt: FloatArray = field(default_factory=lambda: np.eye(3))

    @classmethod
    def of(cls, case: LivedCase, shares: tuple[float, float], described: FloatArray) -> LivedTruth:
        """Return the truth of a case."""
        spec = case.spec
        (truth,) = case.truth or (None,)
        return cls(
            key=case.key,
            cause=spec.cause,
            size=spec.size,
            style=case.held_out.style,
            arm=spec.arm,
            name=truth.name if truth else '',
            joints=truth.joints if truth else (),
            parameters=tuple((p.name, p.joint, p.value) for p in truth.parameters)
            if truth
            else (),
            in_catalogue=truth.in_catalogue if truth else False,
            gap=case.gap,
            share_of_power=shares[0],
            share_of_excess=shares[1],
            gravity=case.gravity,
            described=described,
            friction=spec.friction,
            felt=felt_directions(Chain.of(load_arm(spec.arm))),
        )

    def among(self, named: Named) -> int | None:
        """Return the index of the right name: 0 for the finding, then its rivals; None if none."""
        for k, (name, joints) in enumerate(((named.name, named.joints), *named.rivals)):
            same = name in ALSO.get(self.name, ())
            if name == self.name or (same and set(joints) == set(self.joints)):
                return k
        return None


@dataclass(frozen=True)
class LivedJudged:
    """
    One case with its truth and the answers of the diagnosis.

    Attributes
    ----------
    truth : LivedTruth
        The true change.
    answer : Answer
        Answer for day 2.
    again : Answer or None
        Answer for day 1; None if day 1 was not diagnosed.

    """

    truth: LivedTruth
    answer: Answer
    again: Answer | None = None

    @property
    def first(self) -> bool:
        """Whether the cause is named first, before its rivals."""
        headline = self.answer.headline
        return bool(headline) and self.truth.among(headline[0]) == 0

    @property
    def tied(self) -> bool:
        """Whether the cause is named first, or is in a short tie with the first name."""
        if not self.answer.headline:
            return False
        leading = self.answer.headline[0]
        return self.first or (
            len(leading.rivals) < LARGEST_TIE and self.truth.among(leading) is not None
        )

    @property
    def anywhere(self) -> bool:
        """Whether the cause is in the headline at all."""
        return any(self.truth.among(named) is not None for named in self.answer.headline)

    @property
    def too_many(self) -> int:
        """Number of wrong or redundant names in the headline."""
        true = [named for named in self.answer.headline if self.truth.among(named) is not None]
        mounting = self.truth.name == 'gravity'  # direction and magnitude are two names
        return len(self.answer.headline) - min(len(true), 2 if mounting else 1)

    @property
    def placed(self) -> bool:
        """Whether the first finding of the headline has the joints of the cause."""
        first = self.answer.headline[0]
        names = (first.joints, *(joints for _, joints in first.rivals))
        return set(names[self.truth.among(first) or 0]) == set(self.truth.joints)

    @property
    def share_error(self) -> float:
        """
        Stated share minus the true one; nan if no share is stated.

        If the answer has no true share, the nearer one of `share_of_power` and `share_of_excess`
        is used.

        """
        said = self.answer.headline[0].share
        if np.isfinite(self.answer.true_share):
            return said - self.answer.true_share
        errors = said - np.array([self.truth.share_of_power, self.truth.share_of_excess])
        return float(errors[np.argmin(np.abs(errors))])

    @property
    def admitted(self) -> bool:
        """Whether the answer admits that no effect of the catalogue explains the gap."""
        pushed = self.truth.name == 'pushes' and any(
            'human_interaction' in named.names for named in self.answer.headline
        )
        return self.answer.verdict in ADMITTED or pushed

    def parameter_errors(self) -> list[tuple[float, bool]]:
        """Return relative errors of large values, and whether their intervals hold the truth."""
        if not self.first:
            return []
        said = {(n, j): (value, std) for n, j, value, std in self.answer.headline[0].parameters}
        errors = []
        largest = max(abs(value) for _, _, value in self.truth.parameters)
        for name, joint, true in self.truth.parameters:
            value, std = said.get((name, joint), (np.nan, np.nan))
            if np.isfinite(value) and 3.0 * abs(true) >= largest > 0.0:
                error = abs(value - true)
                errors.append((error / abs(true), bool(error <= 1.96 * std)))
        return errors

    def gravity_error(self) -> tuple[float, float]:
        """Return the error of gravity: of its direction [deg], relative of its magnitude [-]."""
        told = self.truth.felt @ gravity_of(self.answer.headline, self.truth.described)
        there = self.truth.felt @ self.truth.gravity
        size, true = np.linalg.norm(told), np.linalg.norm(there)
        cosine = told @ there / size / true
        return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))), float(size / true - 1.0)


def gravity_of(headline: Iterable[Named], described: FloatArray) -> FloatArray:
    """Return the gravity by the values of a headline, shape (3,) [m/s^2]."""
    values = {name: value for named in headline for name, _, value, _ in named.parameters}
    if 'gravity_x' in values:
        return np.array([values[f'gravity_{axis}'] for axis in 'xyz'])
    turn = Rotation.from_rotvec([values.get('tilt_x', 0.0), values.get('tilt_y', 0.0), 0.0])
    size = np.linalg.norm(described)
    return turn.inv().apply(np.array(described)) * (
        1.0 + values.get('gravity_difference', 0.0) / size
    )


def felt_directions(chain: Chain) -> FloatArray:
    """Return the projection on the directions of gravity that act on any joint, shape (3, 3)."""
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (20, chain.n_joints))
    still = np.zeros_like(q)
    pulls = [chain.with_gravity(unit).torque(q, still, still).ravel() for unit in np.eye(3)]
    _, size, directions = np.linalg.svd(np.column_stack(pulls))
    felt = directions[size > 1e-6 * size[0]]
    return np.asarray(felt.T @ felt)


def probabilities(judged: Sequence[LivedJudged]) -> list[tuple[float, bool]]:
    """Return the probability of each first name, lowest first, and whether it is right."""
    first = [(j.answer.headline[0].probability, j.first) for j in judged if j.answer.headline]
    known = [pair for pair in first if np.isfinite(pair[0])]
    return sorted(known, key=lambda pair: pair[0])


def reliability(
    pairs: Sequence[tuple[float, bool]], least: int = 20
) -> list[tuple[float, float, int]]:
    """Return mean probability, share of right names and count of bins of `least` or more."""
    bins = np.array_split(np.array(pairs, dtype=float).reshape(-1, 2), max(len(pairs) // least, 1))
    return [(*own.mean(axis=0).tolist(), len(own)) for own in bins if len(own)]


def score(judged: Sequence[LivedJudged]) -> tuple[Metric, ...]:
    """Return all metrics of judged cases."""
    free = [j for j in judged if not j.truth.name]
    named = [j for j in judged if nameable(j.truth)]
    seen = [j for j in named if j.truth.gap >= VISIBLE]
    large = [j for j in seen if j.truth.size in ('natural', 'clear')]
    unseen = [j for j in named if j.truth.gap < VISIBLE]
    outside = [j for j in judged if j.truth.name and j not in named and j.truth.gap >= VISIBLE]
    headed = [j for j in seen if j.tied and j.truth.joints]
    stated = [j for j in seen if j.first and np.isfinite(j.share_error)]
    errors = [error for j in seen for error in j.parameter_errors()]
    turned = [j.gravity_error() for j in seen if j.truth.cause == 'mounting']
    again = [j for j in judged if j.again is not None]
    seconds = [j.answer.seconds for j in judged if np.isfinite(j.answer.seconds)]
    shares = [abs(j.share_error) for j in stated]
    answered = [j for j in judged if not j.answer.error]
    gaps = [abs(p - right) for p, right, _ in reliability(probabilities(judged))]
    too_many = [j.too_many for j in answered if not j.truth.name or j.truth.in_catalogue]
    return (
        rate('cause named first', seen, lambda j: j.first, least=0.90),
        rate('  first or in a tie of 3', seen, lambda j: j.tied, least=0.97),
        rate('  anywhere in the headline', seen, lambda j: j.anywhere),
        rate('  first, natural and clear', large, lambda j: j.first),
        rate('  nothing named', seen, lambda j: not j.answer.headline),
        rate('  first, gap below 1', unseen, lambda j: j.first),
        number('names too many', np.mean, too_many, 'at most 0.2', lambda x: x <= 0.2),
        rate('joint of the headline right', headed, lambda j: j.placed, least=0.97),
        rate('nothing happened, silent', free, lambda j: silent(j.answer), least=0.95),
        rate('same day again, silent', again, lambda j: silent(j.again), least=0.95),
        rate('outside the catalogue, said so', outside, lambda j: j.admitted, least=0.90),
        number('reliability, largest gap', np.max, gaps, 'at most 0.07', lambda x: x <= 0.07),
        rate('share within 5 points', shares, lambda e: e <= 0.05),
        number('  error, median', np.median, shares, 'at most 0.05', lambda x: x <= 0.05),
        number('parameter error, median', np.median, [e for e, _ in errors], '', None),
        rate('95 % intervals with the truth', errors, lambda e: e[1], least=0.90, most=0.98),
        rate('mounting within 1 deg and 2 %', turned, lambda e: e[0] <= 1.0 and abs(e[1]) <= 0.02),
        number('  degrees, median', np.median, [e[0] for e in turned], '', None),
        rate('failures', judged, lambda j: bool(j.answer.error)),
        number('processor time, median [s]', np.median, seconds, 'at most 5', lambda x: x <= 5.0),
        number('processor time, longest [s]', np.max, seconds, 'at most 20', lambda x: x <= 20.0),
    )


def breakdown(judged: Sequence[LivedJudged]) -> str:
    """Return the numbers of visible causes that are named first, by cause, style and size."""
    seen = [j for j in judged if j.truth.name and j.truth.gap >= VISIBLE]
    rows = []
    for what in ('cause', 'style', 'size'):
        groups = sorted({getattr(j.truth, what) for j in seen})
        counts = []
        for group in groups:
            own = [j for j in seen if getattr(j.truth, what) == group]
            hits = sum(j.first if nameable(j.truth) else j.admitted for j in own)
            counts.append(f'{group} {hits}/{len(own)}')
        rows.append(f'by {what}: {", ".join(counts)}')
    return '\n'.join([*rows, seconds_by_joints(judged)])


def seconds_by_joints(judged: Sequence[LivedJudged]) -> str:
    """Return the median and the longest processor time by number of joints."""
    taken: dict[int, list[float]] = {}
    for one in judged:
        if np.isfinite(one.answer.seconds):
            taken.setdefault(load_arm(one.truth.arm).n_joints, []).append(one.answer.seconds)
    counts = [
        f'{joints}: {np.median(own):.1f}, {max(own):.1f} of {len(own)}'
        for joints, own in sorted(taken.items())
    ]
    return f'processor time by joints, median and longest [s]: {"; ".join(counts)}'


def nameable(truth: LivedTruth) -> bool:
    """Return whether the catalogue has a name for the cause."""
    return truth.in_catalogue or truth.name == 'gravity'


def silent(answer: Answer | None) -> bool:
    """Return whether there is an answer, and it names nothing."""
    return answer is not None and not answer.headline and not answer.error
