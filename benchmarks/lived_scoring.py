# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Comparison of diagnoses of arms on two days with the truth, as rates with 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.metrics import Metric, number, rate
from benchmarks.two_days import Answer, Named, UNEXPLAINED
from tests.hidden.arrays import FloatArray
from tests.hidden.lived.cases import LivedCase
from tests.hidden.lived.causes.base import Cause
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.specification import LivedSpec

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


@dataclass(frozen=True)
class LivedJudged:
    """
    One case: the true cause, and the answers of the diagnosis.

    Attributes
    ----------
    spec : LivedSpec
        Specification of the case.
    cause : Cause or None
        The true change; None without one.
    gap : float
        Power of the cause over the squared misfit of day 1.
    gravity, described : ndarray, shape (3,)
        True and described gravity [m/s^2].
    felt : ndarray, shape (3, 3)
        Projection on the directions of gravity that affect torques: with parallel axes, gravity
        along them has no effect.
    answer : Answer
        Answer for day 2.
    again : Answer or None
        Answer for day 1; None if day 1 was not diagnosed.

    """

    spec: LivedSpec
    cause: Cause | None
    gap: float
    gravity: FloatArray
    described: FloatArray
    felt: FloatArray
    answer: Answer
    again: Answer | None = None

    @classmethod
    def of(cls, case: LivedCase, answer: Answer, again: Answer | None = None) -> LivedJudged:
        """Return a judged case with the answers of the diagnosis, without its recordings."""
        (cause,) = case.truth or (None,)
        felt = felt_directions(Chain.of(case.robot))
        return cls(
            case.spec, cause, case.gap, case.gravity, case.robot.gravity, felt, answer, again
        )

    def among(self, named: Named) -> int | None:
        """Return the rank of the true cause: 0 if named, from 1 on as a rival; None if absent."""
        if self.cause is None:
            return None
        for k, (name, joints) in enumerate(((named.name, named.joints), *named.rivals)):
            same = name in ALSO.get(self.cause.name, ())
            if name == self.cause.name or (same and set(joints) == set(self.cause.joints)):
                return k
        return None

    @property
    def nameable(self) -> bool:
        """Whether the true cause is an effect of the catalogue or a change of gravity."""
        return self.cause is not None and (self.cause.in_catalogue or self.cause.name == 'gravity')

    @property
    def line(self) -> str:
        """Return the true cause and the answers as a line of text."""
        spec, cause, answer = self.spec, self.cause, self.answer
        right = self.first if self.nameable else self.admitted
        truth = 'nothing'
        if cause is None:
            right = silent(answer)
        else:
            truth = cause.name + (f'@{",".join(cause.joints)}' if cause.joints else '')
        names = '; '.join(map(str, answer.headline)) or 'nothing'
        again = '' if self.again is None else '; '.join(map(str, self.again.headline))
        return (
            f'{spec.key} {spec.arm} {spec.styles["held_out"]} {spec.size} gap {self.gap:.2g} '
            f'share {answer.true_share:.2f}: {truth} -> '
            f'{"right" if right else "-"}: {answer.verdict} {names} | again: {again} '
            f'[{answer.seconds:.1f} s] {answer.error.strip().rpartition(chr(10))[2]}'.rstrip()
        )

    @property
    def first(self) -> bool:
        """Whether the first name of the headline is the true cause, and not only a rival."""
        headline = self.answer.headline
        return bool(headline) and self.among(headline[0]) == 0

    @property
    def tied(self) -> bool:
        """Whether the true cause is the first name, or among the few rivals of the first name."""
        if not self.answer.headline:
            return False
        leading = self.answer.headline[0]
        return self.first or (
            len(leading.rivals) < LARGEST_TIE and self.among(leading) is not None
        )

    @property
    def too_many(self) -> int:
        """Number of wrong or superfluous names in the headline."""
        true = [named for named in self.answer.headline if self.among(named) is not None]
        mounting = (
            self.cause is not None and self.cause.name == 'gravity'
        )  # direction and magnitude are two names
        return len(self.answer.headline) - min(len(true), 2 if mounting else 1)

    @property
    def placed(self) -> bool:
        """Whether the first named effect has the joints of the true cause."""
        first = self.answer.headline[0]
        names = (first.joints, *(joints for _, joints in first.rivals))
        return set(names[self.among(first) or 0]) == set(self.cause.joints)

    @property
    def share_error(self) -> float:
        """Stated minus true share of the gap; NaN if one of the two shares is unknown."""
        return self.answer.headline[0].share - self.answer.true_share

    @property
    def admitted(self) -> bool:
        """Whether the answer admits that no effect of the catalogue explains the gap."""
        pushed = (
            self.cause is not None
            and self.cause.name == 'pushes'
            and any('human_interaction' in named.names for named in self.answer.headline)
        )
        return self.answer.verdict in (*UNEXPLAINED, 'not_repeatable') or pushed

    def parameter_errors(self) -> list[tuple[float, bool]]:
        """Return relative errors of large parameters, and whether intervals hold true values."""
        if not self.first:
            return []
        return self.answer.headline[0].parameter_errors(self.cause.parameters)

    def gravity_error(self) -> tuple[float, float]:
        """Return the errors of the stated gravity: direction [deg], and relative magnitude."""
        stated = self.felt @ gravity_of(self.answer.headline, self.described)
        truth = self.felt @ self.gravity
        size, true = np.linalg.norm(stated), np.linalg.norm(truth)
        cosine = stated @ truth / size / true
        return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))), float(size / true - 1.0)


def gravity_of(headline: Iterable[Named], described: FloatArray) -> FloatArray:
    """Return the gravity vector that a headline states, shape (3,) [m/s^2]."""
    values = {name: value for named in headline for name, _, value, _ in named.parameters}
    if 'gravity_x' in values:
        return np.array([values[f'gravity_{axis}'] for axis in 'xyz'])
    turn = Rotation.from_rotvec([values.get('tilt_x', 0.0), values.get('tilt_y', 0.0), 0.0])
    size = np.linalg.norm(described)
    return turn.inv().apply(np.array(described)) * (
        1.0 + values.get('gravity_difference', 0.0) / size
    )


def felt_directions(chain: Chain) -> FloatArray:
    """Return the projection onto those gravity directions that load a joint, shape (3, 3)."""
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (20, chain.n_joints))
    still = np.zeros_like(q)
    pulls = [chain.with_gravity(unit).torque(q, still, still).ravel() for unit in np.eye(3)]
    _, size, directions = np.linalg.svd(np.column_stack(pulls))
    felt = directions[size > 1e-6 * size[0]]
    return np.asarray(felt.T @ felt)


def probabilities(judged: Sequence[LivedJudged]) -> list[tuple[float, bool]]:
    """Return probability and correctness of each first named cause, lowest probability first."""
    first = [(j.answer.headline[0].probability, j.first) for j in judged if j.answer.headline]
    known = [pair for pair in first if np.isfinite(pair[0])]
    return sorted(known, key=lambda pair: pair[0])


def reliability(
    pairs: Sequence[tuple[float, bool]], least: int = 20
) -> list[tuple[float, float, int]]:
    """Return mean probability, share of right names and number of names of each bin of answers."""
    bins = np.array_split(np.array(pairs, dtype=float).reshape(-1, 2), max(len(pairs) // least, 1))
    return [(*own.mean(axis=0).tolist(), len(own)) for own in bins if len(own)]


def score(judged: Sequence[LivedJudged], kind: str = '') -> tuple[Metric, ...]:
    """Return all rates of judged cases, including rates that only their kind of case has."""
    free = [j for j in judged if j.cause is None]
    changed = [j for j in judged if j.cause is not None and j.gap >= VISIBLE]
    seen = [j for j in changed if j.nameable]
    outside = [j for j in changed if not j.nameable]
    headed = [j for j in seen if j.tied and j.cause.joints]
    stated = [j for j in seen if j.first and np.isfinite(j.share_error)]
    errors = [error for j in seen for error in j.parameter_errors()]
    turned = [j.gravity_error() for j in seen if j.spec.cause == 'mounting']
    again = [j for j in judged if j.again is not None]
    seconds = [j.answer.seconds for j in judged if np.isfinite(j.answer.seconds)]
    shares = [abs(j.share_error) for j in stated]
    answered = [j for j in judged if not j.answer.error]
    gaps = [abs(p - right) for p, right, _ in reliability(probabilities(judged))]
    too_many = [j.too_many for j in answered if j.cause is None or j.cause.in_catalogue]
    return (
        rate('cause named first', seen, lambda j: j.first, least=0.90),
        rate('  first or in a tie of 3', seen, lambda j: j.tied, least=0.97),
        rate('  nothing named', seen, lambda j: not j.answer.headline),
        number('names too many', np.mean, too_many, 'at most 0.2', lambda x: x <= 0.2),
        rate('joint of the headline right', headed, lambda j: j.placed, least=0.97),
        rate('nothing happened, silent', free, lambda j: silent(j.answer), least=0.95),
        rate('same day again, silent', again, lambda j: silent(j.again), least=0.95),
        rate('outside the catalogue, said so', outside, lambda j: j.admitted, least=0.90),
        number('reliability, largest gap', np.max, gaps, 'at most 0.07', lambda x: x <= 0.07),
        rate('share within 5 points', shares, lambda e: e <= 0.05),
        number('parameter error, median', np.median, [e for e, _ in errors], '', None),
        rate('95 % intervals with the truth', errors, lambda e: e[1], least=0.90, most=0.98),
        rate('mounting within 1 deg and 2 %', turned, lambda e: e[0] <= 1.0 and abs(e[1]) <= 0.02),
        rate('failures', judged, lambda j: bool(j.answer.error)),
        number('processor time, median [s]', np.median, seconds, 'at most 5', lambda x: x <= 5.0),
        number('processor time, longest [s]', np.max, seconds, 'at most 20', lambda x: x <= 20.0),
        *_OF_KIND.get(kind.partition('/')[2], lambda _: ())(judged),
    )


def pairs(judged: Sequence[LivedJudged]) -> tuple[Metric, ...]:
    """Return the rates of found causes in point-to-point and periodic motion, and their ratio."""
    by_number = {one.spec.index: one for one in judged}
    whole = [k for k in sorted(by_number) if k % 2 == 0 and k + 1 in by_number]
    periodic = [by_number[k] for k in whole]
    dwells = [by_number[k + 1] for k in whole]
    found = sum(one.tied for one in periodic)
    ratio = [sum(one.tied for one in dwells) / found] if found else []
    return (
        rate('found, periodic', periodic, lambda j: j.tied),
        rate('found, point to point', dwells, lambda j: j.tied),
        number(
            '  of what periodic data give', np.mean, ratio, 'at least 0.85', lambda x: x >= 0.85
        ),
    )


def exact(judged: Sequence[LivedJudged]) -> tuple[Metric, ...]:
    """Return rates of named payloads, and of consistency without a change, for exact URDFs."""
    rows: list[Metric] = []
    for known in ('values', 'names'):
        own = [one for one in judged if one.spec.friction == known]
        loads = [one for one in own if one.spec.cause == 'payload']
        free = [one.answer for one in own if one.cause is None]
        rows += [
            rate(f'payload, friction by {known}', loads, lambda j: j.first, least=0.95),
            rate('  and its mass within 5 %', loads, mass_is_right, least=0.95),
            rate(
                'nothing there, consistent',
                free,
                lambda answer: answer.verdict == 'consistent' and silent(answer),
                least=0.95,
            ),
        ]
    return tuple(rows)


def mass_is_right(judged: LivedJudged) -> bool:
    """Return whether a payload is named, with a mass within 5 % of the true one."""
    if not judged.first:
        return False
    mass = [true for true in judged.cause.parameters if true.name == 'payload_m']
    errors = judged.answer.headline[0].parameter_errors(mass)
    return bool(errors) and errors[0][0] <= 0.05


_OF_KIND: dict[str, Callable[[Sequence[LivedJudged]], tuple[Metric, ...]]] = {
    'pairs': pairs,
    'exact': exact,
}


def silent(answer: Answer | None) -> bool:
    """Return whether an answer exists and names no effect."""
    return answer is not None and not answer.headline and not answer.error
