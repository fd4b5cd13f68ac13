# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Outcomes made up by hand are counted as a person would count them."""

import pytest

from benchmarks.hidden_effects import Judged, score, Truth
from benchmarks.metrics import wilson
from benchmarks.two_days import Answer, Named

ELBOW = ('panda_joint4',)


def truth(kind='single', names=('coulomb_friction',), **changes):
    """Return 0.2 N m of Coulomb friction in the elbow, or something else."""
    parameters = (('coulomb_torque', ELBOW[0], 0.2),)
    facts = {
        'key': 'x',
        'kind': kind,
        'exact': True,
        'names': names,
        'joints': (ELBOW,) * len(names),
        'parameters': (parameters,) * len(names),
        'repeats': True,
        'whole_arm': False,
        'size': 3.0,
        'visible': True,
    }
    return Truth(**(facts | changes))


def said(verdict, *findings):
    """Return an answer."""
    return Answer(verdict, findings, seconds=1.0)


def metric(judged, name):
    """Return a row of the table."""
    return next(m for m in score(judged) if m.name.strip() == name)


RIGHT = Named('coulomb_friction', ELBOW, (), (('coulomb_torque', ELBOW[0], 0.21, 0.01),))
AMBIGUOUS = Named('torque_offset', ELBOW, (('coulomb_friction', ELBOW),))
WRONG = Named('joint_spring', ELBOW)


def test_names_are_right_ambiguous_or_wrong():
    judged = [
        Judged(truth(), said('named', RIGHT)),
        Judged(truth(), said('ambiguous', AMBIGUOUS)),
        Judged(truth(), said('named', WRONG)),
        Judged(truth(), said('unknown')),
    ]
    expected = {
        'top-1 name right': 0.25,
        'truth among the names': 0.5,
        'wrong names': 0.25,
        'parameter error, median': 0.05,
        '95 % intervals with the truth': 1.0,
    }
    assert {name: metric(judged, name).value for name in expected} == pytest.approx(expected)


def test_false_alarm_is_anything_but_silence():
    clean = truth('free', (), joints=(), parameters=(), visible=False)
    off = truth('free', (), joints=(), parameters=(), visible=False, exact=False)
    bodies = Named('link_inertia', ELBOW)
    outcomes = [
        (clean, said('consistent'), False),
        (clean, said('named', RIGHT), True),
        (clean, said('unknown'), True),
        (clean, said('named', bodies), True),
        (off, said('named', bodies), False),
        (off, said('named', bodies, RIGHT), True),
    ]
    for what, outcome, alarm in outcomes:
        assert Judged(what, outcome).false_alarm is alarm


def test_unknown_is_admitted_or_not():
    contact = truth('outside', ('random_contact',), repeats=False)
    patch = truth('outside', ('dead_patch',))
    removed = truth('removed')
    judged = [
        Judged(contact, said('not_repeatable')),
        Judged(patch, said('not_repeatable')),
        Judged(patch, said('unknown')),
        Judged(removed, said('partial', WRONG)),
        Judged(removed, said('named', WRONG)),
    ]
    assert metric(judged, 'unknown or partial').value == 0.6


def test_intervals_are_those_of_wilson():
    assert wilson(0, 120) == pytest.approx((0.0, 0.0310), abs=2e-4)
    assert wilson(150, 156) == pytest.approx((0.9186, 0.9822), abs=2e-3)
    assert wilson(0, 0) == (0.0, 1.0)
