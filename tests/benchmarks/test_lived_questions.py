# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What only one question of lived arms asks is counted against what was said."""

import pytest

from benchmarks.lived_questions import exact, pairs
from benchmarks.lived_scoring import LivedJudged
from benchmarks.two_days import Answer, Named
from tests.benchmarks.truths import truth


def loaded(key, **changes):
    """Return what is true of a case with a payload of 2 kg."""
    facts = {'cause': 'payload', 'name': 'payload', 'joints': ('wrist',)}
    return truth(key=key, parameters=(('payload_m', 'wrist', 2.0),), **facts, **changes)


def free(key, **changes):
    """Return what is true of a case in which nothing happened."""
    facts = {'cause': 'none', 'name': '', 'joints': (), 'parameters': ()}
    return truth(key=key, in_catalogue=False, **facts, **changes)


def payload(mass):
    """Return an answer that names a payload."""
    values = (('payload_m', 'wrist', mass, 0.01),)
    return Answer('named', (Named('payload', ('wrist',), (), values),))


NOTHING = Answer('consistent')


def values(metrics):
    """Return the values of rows in order."""
    return [metric.value for metric in metrics]


def test_point_to_point_is_held_against_what_periodic_data_give():
    answers = (payload(2.0), payload(2.0), payload(2.0), NOTHING, NOTHING, payload(2.0))
    judged = [LivedJudged(loaded(f'development/pairs/{k}'), one) for k, one in enumerate(answers)]
    periodic, dwells, ratio = pairs(judged)
    assert (periodic.value, dwells.value) == (pytest.approx(2 / 3), pytest.approx(2 / 3))
    assert ratio.value == 1.0
    assert ratio.good
    assert pairs(judged[:4])[2].value == 0.5
    assert not pairs(judged[:4])[2].good


def test_exact_arms_are_counted_by_what_is_known_of_friction():
    judged = [
        LivedJudged(loaded('development/exact/0', friction='values'), payload(2.0)),
        LivedJudged(loaded('development/exact/1', friction='names'), payload(3.0)),
        LivedJudged(free('development/exact/2', friction='values'), NOTHING),
        LivedJudged(free('development/exact/4', friction='names'), Answer('unknown')),
    ]
    assert values(exact(judged)) == [1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
