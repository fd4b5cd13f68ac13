# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Cases are what their kind says: one cause or none, of the size that was asked for."""

import numpy as np
import pytest

from tests.hidden.lived.cases import lived_case
from tests.hidden.lived.specification import KINDS, ORDER, SIZES, specify

pytestmark = pytest.mark.long

ROUND = len(ORDER)


def test_a_case_is_the_same_every_time_and_like_no_other():
    first = lived_case('development', 5)
    lived_case.cache_clear()
    again, other = lived_case('development', 5), lived_case('development', 5 + ROUND)
    assert first is not again
    np.testing.assert_array_equal(first.held_out.recording.tau, again.held_out.recording.tau)
    assert first.truth == again.truth
    assert first.truth[0].parameters != other.truth[0].parameters


@pytest.mark.parametrize('kind', KINDS)
def test_specifications_of_all_kinds_have_seeds_of_their_own(kind):
    seeds = {specify(kind, k).seed for k in range(100)}
    others = {specify(k, i).seed for k in KINDS if k != kind for i in range(100)}
    assert len(seeds) == 100
    assert not seeds & others


@pytest.mark.parametrize('index', [1, 4, 9, 10, 12, 13, 21, 26])
def test_a_cause_has_the_size_that_was_asked_for(index):
    case = lived_case('development', index)
    low, high = SIZES[case.spec.size]
    assert low / 1.2 < case.gap < high * 1.2
    held_out = case.held_out.contribution
    worst = ((held_out**2).mean(axis=0) / case.misfit**2).max()
    assert worst == pytest.approx(case.gap, rel=0.2)


def test_only_day_2_has_the_cause_and_nothing_is_nothing():
    case, free = lived_case('development', 1), lived_case('development', 3)
    for run in case.day_1:
        assert not run.contribution.any()
    for run in (*case.day_2, case.held_out):
        guilty = [joint in case.truth[0].joints for joint in run.recording.joints]
        assert np.all(run.contribution.any(axis=0) == guilty)
    assert free.truth == ()
    assert not any(run.contribution.any() for run in (*free.day_2, free.held_out))


def test_the_second_of_a_pair_has_the_cause_of_the_first():
    periodic, pauses = (lived_case('development/pairs', k) for k in (2, 3))
    assert periodic.truth == pauses.truth
    assert periodic.robot is pauses.robot
    assert {r.style for r in periodic.day_2} == {'periodic'}
    assert {r.style for r in pauses.day_2} == {'dwells'}
