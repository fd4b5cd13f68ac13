# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The plain ranking names what takes most, with a day 1 and without."""

import pytest

from benchmarks.lived import judge
from benchmarks.plain_ranking import plain_ranking

pytestmark = pytest.mark.long


@pytest.mark.parametrize(('kind', 'index'), [('development', 0), ('development/exact', 0)])
def test_a_payload_is_first_and_takes_most(kind, index):
    judged = judge(kind, index, again=False, question=plain_ranking)
    assert judged.answer.error == ''
    assert judged.first
    assert judged.placed
    assert judged.answer.headline[0].share > 0.5
    assert all(minor.share <= judged.answer.headline[0].share for minor in judged.answer.minor)
