# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the rules leaves out what the diagnosis asks, and puts it back."""

from pkgutil import resolve_name

import pytest

from benchmarks.ablation import counts, RULES


@pytest.mark.parametrize('name', RULES)
def test_a_rule_is_left_out_for_a_while(name):
    rule = RULES[name]
    places = [f'armid_ros.diagnosis.{place}' for place in rule.places]
    before = [resolve_name(place) for place in places]
    with rule.left_out():
        assert all(resolve_name(place) is rule.without for place in places)
    assert [resolve_name(place) for place in places] == before


def test_where_nothing_was_asked_nothing_is_counted():
    assert counts([]).startswith('  0 of 0 first, 0 tied')
