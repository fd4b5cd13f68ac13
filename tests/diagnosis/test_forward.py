# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Causes are taken one by one; a way that is gone twice is looked along once."""

from dataclasses import replace

from armid_ros.diagnosis.data.discrepancy import Discrepancy
from armid_ros.diagnosis.data.evidence import Evidence
from armid_ros.diagnosis.search import explain
from armid_ros.diagnosis.search.candidates import as_given
from armid_ros.diagnosis.settings import DiagnosisSettings
import numpy as np
import pytest

from tests.diagnosis.conftest import TORQUE_NOISE
from tests.diagnosis.test_floor import cut

LIBRARY = ('viscous_friction', 'coulomb_friction', 'torque_offset', 'joint_spring')


@pytest.fixture
def search(bench):
    def hidden(motion, tau):
        return np.array([0.4, 0.0]) * motion.dq + np.array([0.0, 0.5]) * motion.q

    data = tuple(cut(bench.recordings(hidden)))
    sigma = (np.full(2, TORQUE_NOISE),) * len(data)
    settings = DiagnosisSettings(library=LIBRARY)
    question = as_given(bench.arm, data, 4, LIBRARY)
    return explain.Search(question, Evidence.over_noise(data, sigma), settings)


def taken(way):
    return [(own.effect.name, own.effect.joints) for own in (one.named for one in way.taken)]


def test_the_cause_that_takes_most_is_taken_first(search, monkeypatch):
    looks = []
    look_at = explain.look_at

    def counted(*args):
        looks.append(args)
        return look_at(*args)

    monkeypatch.setattr(explain, 'look_at', counted)
    way = search.forward()
    assert taken(way) == [('viscous_friction', ('shoulder',)), ('joint_spring', ('elbow',))]
    assert len(looks) == 3
    assert way.first.ranking[0].gain > max(one.gain for one in way.last.look.ranking)


@pytest.mark.slow
def test_a_cause_that_another_one_beats_beside_the_rest_is_exchanged(search, monkeypatch):
    """Unless what the others leave in the end is less."""
    way = search.forward()
    right, rest = way.taken
    coulomb = next(
        trial
        for trial in right.step.ranking
        if trial.candidate.key[:2] == ('coulomb_friction', ('shoulder',))
    )
    wrong = explain._of(replace(right.step, trial=coulomb), search.question)
    again = search.exchanged(replace(way, taken=(wrong, rest), last=None))
    assert sorted(taken(again)) == sorted(taken(way))
    assert again.first is way.first
    leaves_less = replace(way, taken=(wrong, rest), last=way.last)
    monkeypatch.setattr(explain.Search, 'forward', lambda *_: replace(way, last=None))
    assert taken(search.exchanged(leaves_less)) == taken(leaves_less)


def test_the_rest_is_no_rival_of_a_cause(search):
    way = search.forward()
    right, rest = way.taken
    beside = right._replace(step=replace(right.step, rivals=(rest.step.trial,)))
    again = search.exchanged(replace(way, taken=(beside, rest)))
    assert taken(again) == taken(way)
    assert not again.taken[0].step.rivals


def test_a_search_for_no_cause_takes_none(bench, search):
    question = as_given(bench.arm, search.evidence.data, 0, LIBRARY)
    way = explain.Search(question, search.evidence, search.settings).forward()
    assert taken(way) == [] and way.first is None


def test_a_shape_that_was_taken_is_no_cause_in_another_shape(bench):
    def hidden(motion, tau):
        return np.array([0.0, 0.6]) * np.sin(5.0 * motion.q + 0.4)

    data = tuple(cut(bench.recordings(hidden)))
    sigma = (np.full(2, TORQUE_NOISE),) * len(data)
    settings = DiagnosisSettings(library=('torque_ripple', 'torque_offset'))
    question = as_given(bench.arm, data, 4, settings.library)
    way = explain.Search(question, Evidence.over_noise(data, sigma), settings).forward()
    assert taken(way) == [('torque_ripple', ('elbow',))]
    assert ('torque_ripple', ('elbow',)) not in [
        one.candidate.key[:2] for one in way.last.look.ranking
    ]


def test_what_is_to_be_explained_does_not_depend_on_what_the_model_lacks_in_every_motion(search):
    """The values of a discrepancy share standard parameters with offsets: a base has their sum."""
    evidence = search.evidence
    discrepancy = Discrepancy.over(evidence.data, np.array([0.3, 0.3]), search.question.arm)
    arm, library = search.question.arm, search.settings.library
    beside = as_given(arm, evidence.data, 4, library, [discrepancy])
    rounds = [
        explain.Search(question, evidence, search.settings).first_place().look.here
        for question in (search.question, beside)
    ]
    assert rounds[1].nuisance.discrepancy
    assert not rounds[0].nuisance.discrepancy
    assert rounds[1].power == pytest.approx(rounds[0].power, rel=1e-3)
