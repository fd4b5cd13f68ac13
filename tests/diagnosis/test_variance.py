# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A cause has changed between two days if recordings of one day do not differ by as much."""

from dataclasses import dataclass, replace

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.next_run.steps import next_steps
from armid_ros.diagnosis.search.search_state import UnseenRows
from armid_ros.diagnosis.search.trial import Candidate
from armid_ros.diagnosis.search.variance import Recordings, UsualSpread
from armid_ros.diagnosis.verdict.words import suspicion
from armid_ros.effects import CATALOGUE, make_effect
from armid_ros.identification import identify
from armid_ros.identification.fitting.normal_equations import NormalEquations
from armid_ros.identification.rows.signals import Conditioning
from armid_ros.report.diagnosis_report import tone_of
import numpy as np
import pytest
from scipy import stats

ROWS = 12


@dataclass(frozen=True)
class Rows:
    """Rows of one recording."""

    free: np.ndarray
    own: np.ndarray
    residual: np.ndarray


def recording(rng, value):
    """Return rows of a recording in which a cause has a value, beside an unknown slope."""
    free, own = rng.normal(size=(2, ROWS, 1))
    return Rows(free, own, value * own[:, 0] + 0.7 * free[:, 0] + 0.05 * rng.normal(size=ROWS))


def chance(first, second, usual):
    rows = [*first, *second]
    free, left = ([getattr(one, n) for one in rows] for n in ('free', 'residual'))
    known = NormalEquations.of_rows(np.concatenate(free), np.concatenate(left))
    days = Recordings.of(free, left, [False] * len(first) + [True] * len(second), known)
    found = days.variance([one.own for one in rows], np.array([1e-9]), 1.0, 0.02)
    return usual.chance(found)


#: Values of recordings have a variance of one, which is some 12 times that of white noise of a
#: unit of one, as each has 12 rows.
WHOLE = UsualSpread(12.0, 4.0)
#: What other candidates say does not count.
ALONE = UsualSpread(1.0, 1e-9)


def test_it_is_the_analysis_of_variance_of_the_values_of_recordings():
    """Of recordings that show the cause alike, without nuisance parameters or others."""
    rng = np.random.default_rng(0)
    for first, second in ((3, 4), (2, 5), (1, 3)):
        values = rng.normal(size=first + second)
        own = np.ones((ROWS, 1))
        days = [Rows(np.zeros((ROWS, 1)), own, value * own[:, 0]) for value in values]
        expected = stats.f_oneway(values[:first], values[first:]).pvalue
        assert chance(days[:first], days[first:], ALONE) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize('usual', [ALONE, WHOLE], ids=['alone', 'with others'])
def test_days_that_are_draws_of_one_process_are_as_unlikely_as_is_said(usual):
    rng = np.random.default_rng(1)
    chances = []
    for _ in range(400):
        days = [recording(rng, value) for value in rng.normal(size=7)]
        chances.append(chance(days[:3], days[3:], usual))
    assert stats.kstest(chances, 'uniform').pvalue > 0.01


def test_heavy_tails_make_no_change_likelier():
    rng = np.random.default_rng(1)
    count = 0
    for _ in range(400):
        days = [recording(rng, value) for value in rng.standard_t(1.0, size=7)]
        count += chance(days[:3], days[3:], ALONE) < 0.01
    assert count <= 4


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


def test_many_recordings_tell_a_change_that_is_smaller_than_the_misfit(bench):
    rng = np.random.default_rng(0)
    old, new = worn(bench, range(1, 7), 0.0), worn(bench, range(11, 17), 0.4)
    arm = identify(bench.arm, old, rng=rng).arm
    found = diagnose(arm, new, baseline=old, rng=rng)
    named = [(one.name, one.joints) for one in found.findings]
    assert named == [('coulomb_friction', ('elbow',))], found.summary


def test_a_change_that_few_recordings_hardly_tell_is_suspected_and_not_named(bench):
    rng = np.random.default_rng(0)
    old, new = worn(bench, (1, 2, 3), 0.0), worn(bench, (11, 12, 13), 0.4)
    arm = identify(bench.arm, old, rng=rng).arm
    found = diagnose(arm, new, baseline=old, rng=rng)
    assert (found.verdict, found.findings) == ('consistent', ()), found.summary
    (suspected,) = found.suspected
    assert (suspected.name, suspected.joints) == ('coulomb_friction', ('elbow',))
    assert suspicion([suspected]) in found.summary
    assert any('three more' in step for step in next_steps(found))
    assert tone_of(found) == 'fair'


def test_stretches_of_one_recording_are_one_recording_of_the_test(bench):
    """Unbroken stretches of one recording are no more independent than its halves are."""
    data = trajectories(bench.recordings(), Conditioning(200.0, 20.0, 5))
    stretches = [data[0], replace(data[1], fold=0), data[2]]
    unit = tuple(np.ones(2) for _ in data)
    evidence = Evidence(tuple(stretches), unit, unit)
    rng = np.random.default_rng(0)
    columns = [rng.normal(size=(*part.torque.shape, 3)) for part in data]
    later = UnseenRows.of(evidence, columns, [part.torque for part in data])
    rows = [part.torque.size for part in data]
    assert [len(one) for one in later.residual] == [rows[0] + rows[1], rows[2]]
    assert [one.shape for one in later.free] == [(rows[0] + rows[1], 3), (rows[2], 3)]
    effect = CATALOGUE['torque_offset'].on(bench.robot, ('elbow',))
    candidate = Candidate(effect, slice(0, 1), (0,), bench.robot)
    wider = later.and_columns(bench.arm, candidate)
    assert [one.shape[1] for one in wider.free] == [4, 4]
