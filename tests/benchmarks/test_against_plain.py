# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis is right wherever the plain ranking is: on a few cheap cases of every kind."""

from dataclasses import asdict
import json

from armid_ros.effects import CATALOGUE
import numpy as np
import pytest

from benchmarks.against_plain import counts, FAMILIES, lived_rows, read, right, Row
from benchmarks.lived import judge
from benchmarks.plain_ranking import plain_ranking


def test_rows_count_for_every_group_that_they_are_of():
    both = 'development', 'motion: natural'
    rows = [Row(both, 'a', True, True, False), Row(both[:1], 'b', False, True, True)]
    assert counts(rows) == {
        'development': (1, 2, 1, 2),
        'motion: natural': (1, 1, 0, 1),
        'all': (1, 2, 1, 2),
    }


def test_families_are_of_names_of_the_catalogue():
    known = {*CATALOGUE, 'gravity'}
    assert {name for names in FAMILIES.values() for name in names} <= known


@pytest.mark.long
@pytest.mark.parametrize(
    ('kind', 'index'),
    [
        ('development/exact', 9),  # nothing happened
        ('development/exact', 12),  # payload
        ('development/pairs', 18),  # periodic, load-dependent friction
        ('development/pairs', 19),  # point to point
        ('development', 8),  # mounting, with a day 1
    ],
)
def test_the_diagnosis_is_right_where_the_plain_ranking_is(kind, index, tmp_path):
    found = judge(kind, index, again=False)
    plain = judge(kind, index, again=False, question=plain_ranking)
    rows = lived_rows([found], [plain])
    assert len(rows) == 1
    assert rows[0].found
    assert rows[0].tied >= rows[0].plain
    path = tmp_path / 'answers.json'
    path.write_text(json.dumps([asdict(found)], default=np.ndarray.tolist))
    (again,) = read(path)
    assert right(again) == right(found)
