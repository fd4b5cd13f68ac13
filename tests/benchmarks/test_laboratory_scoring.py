# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Outcomes made up by hand are counted as a person would count them."""

import pytest

from benchmarks.hidden_effects import Judged, score
from benchmarks.two_days import Answer, Named
from tests.hidden.specification import CaseSpec, HIDDEN

ELBOW = ('panda_joint4',)


def judged(kind, name, verdict, *findings, exact=True):
    """Return an answer about an effect in the elbow, such as 0.2 N m of Coulomb friction."""
    names = (name,) if name else ()
    spec = CaseSpec('x', kind, 'panda', names, (3.0,) * len(names), exact, False, 1.0, 0)
    effects = tuple(HIDDEN[one](ELBOW[0], 3, 0.2) for one in names)
    return Judged(spec, effects, 3.0, False, Answer(verdict, findings, seconds=1.0))


def metric(outcomes, name):
    """Return a row of the table."""
    return next(m for m in score(outcomes) if m.name.strip() == name)


RIGHT = Named('coulomb_friction', ELBOW, (), (('coulomb_torque', ELBOW[0], 0.21, 0.01),))
AMBIGUOUS = Named('torque_offset', ELBOW, (('coulomb_friction', ELBOW),))
WRONG = Named('joint_spring', ELBOW)


def test_names_are_right_ambiguous_or_wrong():
    outcomes = [
        judged('single', 'coulomb_friction', 'named', RIGHT),
        judged('single', 'coulomb_friction', 'ambiguous', AMBIGUOUS),
        judged('single', 'coulomb_friction', 'named', WRONG),
        judged('single', 'coulomb_friction', 'unknown'),
    ]
    expected = {
        'top-1 name right': 0.25,
        'truth among the names': 0.5,
        'wrong names': 0.25,
        'parameter error, median': 0.05,
        '95 % intervals with the truth': 1.0,
    }
    assert {name: metric(outcomes, name).value for name in expected} == pytest.approx(expected)


def test_false_alarm_is_anything_but_silence():
    bodies = Named('link_inertia', ELBOW)
    for verdict, findings, exact, alarm in (
        ('consistent', (), True, False),
        ('named', (RIGHT,), True, True),
        ('unknown', (), True, True),
        ('named', (bodies,), True, True),
        ('named', (bodies,), False, False),
        ('named', (bodies, RIGHT), False, True),
    ):
        assert judged('free', '', verdict, *findings, exact=exact).false_alarm is alarm


def test_unknown_is_admitted_or_not():
    outcomes = [
        judged('outside', 'random_contact', 'not_repeatable'),
        judged('outside', 'dead_patch', 'not_repeatable'),
        judged('outside', 'dead_patch', 'unknown'),
        judged('removed', 'coulomb_friction', 'partial', WRONG),
        judged('removed', 'coulomb_friction', 'named', WRONG),
    ]
    assert metric(outcomes, 'unknown or partial').value == 0.6
