# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which numbers change an answer is found by changing many together, and taking them apart."""

from dataclasses import fields

from armid_ros.diagnosis.data import trajectory
from armid_ros.diagnosis.search import look, trial
from armid_ros.diagnosis.settings import Thresholds
from armid_ros.diagnosis.verdict import document
from armid_ros.identification.rows import stamps
import pytest

from benchmarks.lived_scoring import LivedJudged
from benchmarks.thresholds import (
    Asked,
    changed,
    counts,
    deciding,
    of_modules,
    one_case,
    SAMPLE,
    scaled,
    varied,
)
from benchmarks.two_days import Answer, Named
from tests.benchmarks.truths import truth

NAMES = [field.name for field in fields(Thresholds)]
TRUTH = truth(name='rotor_inertia', parameters=())
RIGHT = LivedJudged(TRUTH, Answer('named', (Named('rotor_inertia', ('elbow',)),)))
SILENT = LivedJudged(TRUTH, Answer('consistent'))


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('factor', [0.7, 1.3])
def test_one_number_is_changed_and_no_other(name, factor):
    other, usual = varied([name], factor).thresholds, Thresholds()
    assert [one for one in NAMES if getattr(other, one) != getattr(usual, one)] == [name]
    assert 0.0 < other.confidence < 1.0


def test_a_number_of_a_module_is_changed_wherever_it_was_imported_and_back_again():
    usual = trial.ROUNDING
    with changed(['search/trial.py ROUNDING', 'price', 'search/look.py _COMPARED'], 0.7):
        assert trial.ROUNDING == document.ROUNDING == pytest.approx(0.7 * usual)
        assert look._COMPARED == round(0.7 * 8)
    assert trial.ROUNDING == document.ROUNDING == usual
    assert look._COMPARED == 8


def test_numbers_of_modules_are_all_found_once():
    found = of_modules()
    assert len(found) == len(set(found)) > 40
    assert {'BLOCKS', '_REST_SPEED', '_UNEVEN'} <= {name.split()[-1] for name in found}
    with changed(found, 1.3):
        assert stamps._UNEVEN == pytest.approx(0.065)
        assert trajectory.BLOCKS == 8
        assert trajectory._REST_SPEED == pytest.approx(0.026)


def test_a_level_is_moved_by_what_is_beyond_it():
    assert scaled(0.975, 0.7) == pytest.approx(0.9825)
    assert scaled((1.0, -2), 0.5) == (0.5, -1)


@pytest.mark.parametrize('guilty', [set(), {'price'}, {'price', 'many_causes'}, set(NAMES)])
def test_the_numbers_that_change_an_answer_are_found(guilty):
    asked = []

    def said(names):
        asked.append(names)
        return SILENT if guilty & set(names) else RIGHT

    assert {name for name, _ in deciding(NAMES, said, RIGHT)} == guilty
    if len(guilty) < 2:
        assert len(asked) < len(NAMES)


def test_a_changed_answer_counts_where_it_was_given():
    asked = Asked(RIGHT, {('price', 0.7): SILENT})
    assert asked.with_change(('price', 0.7)) is SILENT
    assert asked.with_change(('price', 1.3)) is RIGHT
    assert counts([asked.usual]).startswith('1 of 1 first')
    assert counts([asked.with_change(('price', 0.7))]).startswith('0 of 1 first')
    assert 'price 0.7' in one_case(asked)


def test_the_sample_is_of_development_kinds_alone():
    assert all(key.startswith('development') for key in SAMPLE)
    assert len(set(SAMPLE)) == len(SAMPLE) >= 16
