# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Stamps that come late by more than a period each are told from samples that are lost."""

from dataclasses import replace

from armid_ros.errors import IdentificationError
from armid_ros.identification import grade, IdentificationSettings, identify
from armid_ros.identification.rows.signals import SignalSettings
from armid_ros.identification.rows.stamps import uneven_stamps
import numpy as np
import pytest

from ..conftest import multisine, recorded

RATE = 200.0
CUTOFF, BAND = 9.0, 2.0


@pytest.fixture(scope='module')
def run(arm):
    motion = multisine(arm.robot.joints, 16.0, RATE, seed=1, base_hz=0.12)
    return recorded(arm, motion, torque_noise=0.02, source='run')


def jittered(run, by):
    noise = np.random.default_rng(1).uniform(-by, by, len(run))
    return replace(run, t=np.sort(run.t + noise))


def with_losses(run):
    return run.select(np.random.default_rng(1).random(len(run)) > 0.2)


def slewed(run):
    return replace(run, t=run.t + 2e-4 * run.t**2)


def test_stamps_off_by_more_than_a_period_are_said(run):
    assert 'uneven' in uneven_stamps(jittered(run, 0.02), CUTOFF, BAND)


def test_even_stamps_lost_samples_small_jitter_and_a_slewed_clock_are_not(run):
    for one in (run, with_losses(run), jittered(run, 0.001), slewed(run)):
        assert uneven_stamps(one, CUTOFF, BAND) == ''


def test_identification_says_it_where_too_little_is_left(structure, run):
    few = IdentificationSettings(signals=SignalSettings(CUTOFF, decimation=60))
    short = jittered(run, 0.02).select(slice(0, 1000))
    with pytest.raises(IdentificationError, match='uneven'):
        identify(structure, [short], few, rng=np.random.default_rng(0))


def test_a_grade_says_it_where_enough_is_left(structure, run):
    late = jittered(run, 0.009)
    fitted = identify(structure, [late], rng=np.random.default_rng(0))
    found = grade(fitted, structure, [late], {})
    assert found.word != 'good'
    assert any('uneven' in one for one in found.reasons)
