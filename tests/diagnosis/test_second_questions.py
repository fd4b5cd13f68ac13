# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is asked again where the first answer does not stand on other recordings."""

from types import SimpleNamespace

from armid_ros.diagnosis.diagnose import _what_stands
from armid_ros.diagnosis.settings import DiagnosisSettings
import pytest


class Answers:
    """Says what is found with a library, and counts the questions."""

    def __init__(self, answers):
        self._answers = answers
        self.asked = 0

    def __call__(self, settings):
        self.asked += 1
        for name, verdict, harmful in self._answers:
            if name in settings.library:
                fallen = frozenset({name} if harmful or verdict == 'unknown' else ())
                return SimpleNamespace(verdict=verdict, harmful=harmful, name=name), fallen
        return SimpleNamespace(verdict='unknown', harmful=False, name=''), frozenset()


@pytest.mark.parametrize(
    ('answers', 'name', 'asked'),
    [
        ([('joint_spring', 'named', False)], 'joint_spring', 1),
        ([('payload', 'named', True), ('joint_spring', 'named', False)], 'joint_spring', 2),
        ([('payload', 'unknown', False), ('joint_spring', 'ambiguous', False)], 'joint_spring', 2),
        ([('payload', 'partial', False), ('joint_spring', 'named', False)], None, 1),
        ([('payload', 'named', True)], None, 2),
        ([], None, 1),
    ],
)
def test_names_that_do_not_stand_are_left_out_one_by_one(answers, name, asked):
    ask = Answers([('torque_gain', 'named', True), *answers])
    found = _what_stands(ask, DiagnosisSettings(), frozenset({'torque_gain'}))
    assert (found and found.name) == name
    assert ask.asked == asked


def test_nothing_is_asked_where_nothing_fell():
    ask = Answers([('joint_spring', 'named', False)])
    assert _what_stands(ask, DiagnosisSettings(), frozenset()) is None
    assert ask.asked == 0
