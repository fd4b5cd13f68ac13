# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction over measured temperature, of arms with another law: slopes, cold starts and wear."""

from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.errors import IdentificationError
from armid_ros.identification import identify
from armid_ros.identification.rows.temperature import friction_per_kelvin
import numpy as np
import pytest

from tests.diagnosis.conftest import changed_since, diagnosed
from tests.hidden.warm_arm import JOINTS, ROBOT, WarmArm

USUAL = 'viscous_friction,coulomb_friction,torque_offset'
LAW = 'temperature_dependent_friction'
#: Temperatures at which a model is identified, and of a cold and of a warm day [degC].
RANGE, COLD, WARM = (25, 40, 25, 32, 40), (23, 25, 24), (39, 41, 40)
DRAWS = range(20)
SLOPES = re.compile(r'viscous (\S+) ± (\S+) %/K, Coulomb (\S+) ± (\S+) %/K')


def model_of(recordings, effects):
    return identify(ArmModel.of(ROBOT, effects=effects), recordings, rng=np.random.default_rng(0))


def since(baseline, today, effects=USUAL):
    """Return the diagnosis of a day with a model of the baseline."""
    return changed_since(ArmModel.of(ROBOT, effects=effects), baseline, today)


def names(found):
    return [one.name for one in found.findings]


@pytest.fixture(scope='module')
def arm():
    return WarmArm(np.array([0.9, 0.8, 0.4]), np.array([1.2, 1.0, 0.5]))


def slopes_of(recordings):
    """Return viscous and Coulomb slopes with half widths [%/K], one row for each joint."""
    found = model_of(recordings, f'{USUAL},{LAW}')
    texts = friction_per_kelvin(found.arm, found.estimate, found.scatter)
    return np.array([[float(x) for x in SLOPES.search(text).groups()] for text in texts])


def test_the_slopes_of_friction_are_found(arm):
    viscous, _, coulomb, _ = slopes_of(arm.record(np.random.default_rng(1), RANGE, 'day')).T
    np.testing.assert_allclose(viscous, -2.0, rtol=0.1)
    np.testing.assert_allclose(coulomb, -0.6, atol=0.15)


def test_a_cold_start_is_named_in_degrees(arm):
    rng = np.random.default_rng(2)
    found = since(arm.record(rng, WARM, 'warm'), arm.record(rng, COLD, 'cold'))
    assert names(found) == [LAW], found.summary
    assert set(found.findings[0].joints) == set(JOINTS)
    assert 'Colder than in the baseline: turn by 16 degC (friction +' in found.summary


def test_wear_is_named_at_equal_temperature(arm):
    rng = np.random.default_rng(3)
    baseline = arm.record(rng, RANGE, 'before')
    worn = arm.worn('elbow', 1.4).record(rng, COLD, 'after')
    found = since(baseline, worn, f'{USUAL},{LAW}')
    assert set(names(found)) <= {'viscous_friction', 'coulomb_friction'}, found.summary
    assert all(one.joints == ('elbow',) for one in found.findings)
    assert 'of elbow changed at equal temperature' in found.summary
    assert 'Colder than in the baseline' in found.summary


def test_a_model_without_the_law_is_not_blamed_for_the_temperature(arm):
    """Without measured temperature, the same day is a change of friction."""
    rng = np.random.default_rng(4)
    warm, cold = arm.record(rng, WARM, 'warm'), arm.record(rng, COLD, 'cold')
    blind = [replace(one, temperature=None) for one in cold]
    found = since(warm, blind)
    assert LAW not in names(found) and 'degC' not in found.summary
    model = model_of(arm.record(rng, RANGE, 'day'), f'{USUAL},{LAW}').arm
    found = diagnosed(model, blind, baseline=warm)
    assert 'The temperature was not recorded' in found.summary


def test_the_law_needs_temperatures(arm):
    (run,) = arm.record(np.random.default_rng(5), (25,), 'run')
    with pytest.raises(IdentificationError, match=r'run 0: temperature_dependent_friction needs'):
        model_of([replace(run, temperature=None)], LAW)


@pytest.mark.long
def test_slopes_hold_their_intervals_and_healthy_arms_have_no_name():
    held, near = [], []
    for seed in DRAWS:
        rng = np.random.default_rng(1000 + seed)
        arm = WarmArm.drawn(rng)
        baseline = arm.record(rng, rng.permutation(RANGE), 'before')
        viscous, reach, coulomb, wide = slopes_of(baseline).T
        held += (np.abs(viscous + 100 * arm.viscous_rate) <= reach).tolist()
        held += (np.abs(coulomb + 100 * arm.coulomb_rate) <= wide).tolist()
        near += (np.abs(viscous / (100 * arm.viscous_rate) + 1.0) <= 0.1).tolist()
        today = arm.record(rng, rng.uniform(25, 40, 3), 'after')
        assert names(since(baseline, today, f'{USUAL},{LAW}')) == [], seed
        assert set(names(since(baseline, today))) <= {LAW}, seed
    assert np.mean(held) >= 0.9
    assert np.mean(near) >= 0.95


@pytest.mark.long
def test_cold_starts_and_wear_of_drawn_arms_are_told_apart():
    right = np.zeros(2)
    for seed in DRAWS:
        rng = np.random.default_rng(2000 + seed)
        arm, joint = WarmArm.drawn(rng), JOINTS[rng.integers(3)]
        cold = since(arm.record(rng, WARM, 'warm'), arm.record(rng, COLD, 'cold'))
        right[0] += names(cold) == [LAW] and 'Colder than in the baseline' in cold.summary
        baseline = arm.record(rng, rng.permutation(RANGE), 'before')
        worn = arm.worn(joint, rng.uniform(1.2, 1.5)).record(rng, COLD, 'after')
        found = since(baseline, worn)
        others = [one for one in found.findings if one.name != LAW]
        right[1] += bool(others) and all(
            one.name in ('viscous_friction', 'coulomb_friction') and one.joints == (joint,)
            for one in others
        )
    assert right.min() >= 18, right
