# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Metrics of single kinds of cases: exact arms, point to point against periodic motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.lived_scoring import LivedJudged
from benchmarks.metrics import Metric, number, rate

_MASS = 'payload_m'


def score_of_question(kind: str, judged: Sequence[LivedJudged]) -> tuple[Metric, ...]:
    """Return the metrics of a kind of cases in addition to the common ones."""
    return _QUESTIONS.get(kind.partition('/')[2], lambda _: ())(judged)


def pairs(judged: Sequence[LivedJudged]) -> tuple[Metric, ...]:
    """Return the rates of causes found in point to point and in periodic motion, and the ratio."""
    by_number = {int(one.truth.key.rpartition('/')[2]): one for one in judged}
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
    """Return the rates of named payloads and of false alarms, for exact descriptions."""
    rows: list[Metric] = []
    for known in ('values', 'names'):
        own = [one for one in judged if one.truth.friction == known]
        loads = [one for one in own if one.truth.cause == 'payload']
        free = [one for one in own if not one.truth.name]
        rows += [
            rate(f'payload, friction by {known}', loads, lambda j: j.first, least=0.95),
            rate('  and its mass within 5 %', loads, mass_is_right, least=0.95),
            rate('nothing there, consistent', free, is_consistent, least=0.95),
        ]
    return tuple(rows)


def mass_is_right(judged: LivedJudged) -> bool:
    """Return whether a payload is named, with a mass within 5 % of the true one."""
    if not judged.first:
        return False
    said = [
        value for name, _, value, _ in judged.answer.headline[0].parameters if name == 'payload_m'
    ]
    true = [value for name, _, value in judged.truth.parameters if name == 'payload_m']
    return len(said) == len(true) == 1 and abs(said[0] - true[0]) <= 0.05 * abs(true[0])


def is_consistent(judged: LivedJudged) -> bool:
    """Return whether the verdict is `consistent` without names."""
    return judged.answer.verdict == 'consistent' and not judged.answer.headline


_QUESTIONS: dict[str, Callable[[Sequence[LivedJudged]], tuple[Metric, ...]]] = {
    'pairs': pairs,
    'exact': exact,
}
