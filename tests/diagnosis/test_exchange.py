# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A cause has changed between two days if no other division of the recordings shows more of it."""

from dataclasses import replace

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.acceptance import Rows, showing_more
from armid_ros.diagnosis.search.round import Later
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.identification import identify
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest

ROWS = 12


def recording(rng, value):
    """Return rows of a recording in which a cause has a value, beside an unknown slope."""
    free, own = rng.normal(size=(2, ROWS, 1))
    return Rows(free, own, value * own[:, 0] + 0.7 * free[:, 0] + 0.05 * rng.normal(size=ROWS))


def asked(first, second):
    rows = [*first, *second]
    free = np.concatenate([one.free for one in rows])
    left = np.concatenate([one.residual for one in rows])
    known = NormalEquations.of_rows(free, left)
    more, _divisions = showing_more(first, second, known, np.array([1e-9]), 0.0)
    return more == 0


@pytest.mark.parametrize('freedom', [1.0, 2.0, 100.0], ids=['wild', 'heavy tails', 'normal'])
def test_days_that_are_draws_of_one_process_rarely_stand_out(freedom):
    """With three recordings and four there are 35 divisions: each is the first as often."""
    rng = np.random.default_rng(1)
    count = 0
    for _ in range(250):
        values = rng.standard_t(freedom, size=7)
        days = [recording(rng, value) for value in values]
        count += asked(days[:3], days[3:])
    assert 1 <= count <= 16  # 250 / 35 is 7, and three deviations more are 15


def test_a_change_beyond_what_recordings_differ_by_stands_out():
    rng = np.random.default_rng(2)
    for _ in range(20):
        values = rng.normal(size=7) + np.array([0, 0, 0, 9, 9, 9, 9])
        days = [recording(rng, value) for value in values]
        assert asked(days[:3], days[3:])


def test_values_that_no_motion_shows_hide_no_change():
    """An arm in a plane shows four of the ten values of a payload."""
    rng = np.random.default_rng(2)
    values = rng.normal(size=7) + np.array([0, 0, 0, 9, 9, 9, 9])
    days = [recording(rng, value) for value in values]
    wide = [Rows(one.free, np.hstack([one.own, 1e-12 * one.own]), one.residual) for one in days]
    free, left = (np.concatenate([getattr(one, n) for one in days]) for n in ('free', 'residual'))
    known = NormalEquations.of_rows(free, left)
    assert showing_more(wide[:3], wide[3:], known, np.array([1e-9, 0.3]), 0.0) == (0, 34)


def faintly(rng, value, share):
    """Return rows of a recording whose motion hardly shows the cause."""
    free, own = rng.normal(size=(2, ROWS, 1)) * [[[1.0]], [[share]]]
    return Rows(free, own, value * own[:, 0] + 0.05 * rng.normal(size=ROWS))


def shown(first, second, faint):
    rows = [*first, *second]
    free, left = (np.concatenate([getattr(one, n) for one in rows]) for n in ('free', 'residual'))
    known = NormalEquations.of_rows(free, left)
    return showing_more(first, second, known, np.array([1e-9]), faint)


def test_a_recording_that_hardly_shows_a_cause_says_nothing_of_when_it_changed():
    """To exchange it makes no other division; it would show more of the cause by chance."""
    rng = np.random.default_rng(5)
    found = []
    for _ in range(20):
        days = [
            *(recording(rng, v) for v in (0.0, 0.1, 0.0, 1.0, 1.1, 0.9)),
            faintly(rng, 1.0, 0.01),
        ]
        found.append([shown(days[:3], days[3:], faint)[0] for faint in (0.0, 0.02)])
    assert not any(clear for _, clear in found)
    assert 5 <= sum(more > 0 for more, _ in found) <= 15


def test_a_cause_that_one_day_hardly_shows_has_not_changed_as_far_as_they_tell():
    rng = np.random.default_rng(6)
    before = [faintly(rng, 1.0, 0.001) for _ in range(3)]
    assert shown(before, [recording(rng, 1.0) for _ in range(3)], 0.02) == (1, 1)


def test_what_one_recording_of_the_day_before_had_as_well_is_no_change():
    rng = np.random.default_rng(3)
    values = [0.0, 3.0, 0.0, 1.0, 3.0, 1.0]
    days = [recording(rng, value) for value in values]
    assert not asked(days[:3], days[3:])


def test_one_recording_a_day_cannot_be_divided_otherwise():
    rng = np.random.default_rng(4)
    assert asked([recording(rng, 0.0)], [recording(rng, 1.0)])


def with_offsets(bench, seed, offsets):
    """Return recordings of an elbow that has another offset in each [N m]."""

    def on_elbow(offset):
        return lambda motion, tau: np.column_stack([0.0 * motion.t, 0.0 * motion.t + offset])

    return [bench.recordings(on_elbow(x), seed=seed)[k] for k, x in enumerate(offsets)]


@pytest.mark.parametrize(
    'before, after, named',
    [
        ((0.0, 0.8, 0.1), (0.45, 0.55, 0.5), False),
        ((0.0, 0.05, 0.1), (0.45, 0.55, 0.5), True),
    ],
    ids=['one recording from before had it', 'none had it'],
)
def test_an_offset_that_differs_from_recording_to_recording(bench, before, after, named):
    rng = np.random.default_rng(0)
    old = with_offsets(bench, 1, before)
    arm = bench.arm.with_effect(make_effect('torque_offset', bench.robot))
    arm = identify(arm, old, rng=rng).arm
    new, unseen = with_offsets(bench, 2, after), with_offsets(bench, 3, after)[:1]
    found = diagnose(arm, new, validate=unseen, baseline=old, rng=rng)
    assert [one.name for one in found.findings] == ['torque_offset'] * named, found.summary


def worn(bench, seeds, coulomb):
    """Return recordings of arms that no model describes, with another dry friction each [N m]."""

    def hidden(motion, tau):
        bumps = 0.5 * np.sin(9.0 * motion.q[:, ::-1] + motion.q)
        return bumps + np.column_stack([0.0 * motion.t, coulomb * np.sign(motion.dq[:, 1])])

    return [bench.recordings(hidden, seed=seed)[seed % 3] for seed in seeds]


@pytest.mark.parametrize('many', [False, True])
def test_many_recordings_tell_a_change_that_is_smaller_than_the_misfit(bench, many):
    """With three recordings a day 20 divisions are as good; with six there are hundreds."""
    count = 6 if many else 3
    rng = np.random.default_rng(0)
    old = worn(bench, range(1, count + 1), 0.0)
    new = worn(bench, range(11, count + 11), 0.4)
    arm = identify(bench.arm, old, rng=rng).arm
    found = diagnose(arm, new, baseline=old, rng=rng)
    assert [(one.name, one.joints) for one in found.findings] == [
        ('coulomb_friction', ('elbow',))
    ] * many, found.summary


def test_stretches_of_one_recording_are_one_unit_of_the_permutation_test(bench):
    """Unbroken stretches of one recording are no more independent than its halves are."""
    data = trajectories(bench.recordings(), Conditioning(200.0, 20.0, 5))
    stretches = [data[0], replace(data[1], fold=0), data[2]]
    unit = tuple(np.ones(2) for _ in data)
    evidence = Evidence(tuple(stretches), unit, unit)
    rng = np.random.default_rng(0)
    columns = [rng.normal(size=(*part.torque.shape, 3)) for part in data]
    later = Later.of(evidence, columns, [part.torque for part in data])
    rows = [part.torque.size for part in data]
    assert [len(one) for one in later.residual] == [rows[0] + rows[1], rows[2]]
    assert [one.shape for one in later.free] == [(rows[0] + rows[1], 3), (rows[2], 3)]
    effect = CATALOGUE['torque_offset'].on(bench.robot, ('elbow',))
    candidate = Candidate(effect, slice(0, 1), (0,), bench.robot)
    wider = later.and_columns(bench.arm, candidate)
    assert [one.shape[1] for one in wider.free] == [4, 4]
