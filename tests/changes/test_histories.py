# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Changes of arms over time: found where there are, and rarely where there are none."""

from armid_ros.changes.histories import (
    judge,
    MONTH,
    ParameterHistory,
    significant,
    spreads,
    wear,
    without_days,
)
import numpy as np
import pytest

from benchmarks.healthy_arms import lasting, tally

PARAMETERS = [('viscous_coefficient', f'joint_{k}') for k in range(8)]


def fleet(rng, arms, bags=10, beyond=0.5):
    """Return series of healthy arms: noise as stated, and some beyond it."""
    days = np.arange(bags, dtype=float)
    found = []
    for arm in range(arms):
        for name, joint in PARAMETERS:
            std = 0.01 * rng.uniform(0.5, 2.0, bags)
            noise = std * rng.normal(size=bags) + beyond * 0.01 * rng.normal(size=bags)
            values = rng.normal(1.0, 0.2) + noise
            found.append(
                ParameterHistory(f'arm_{arm}', name, joint, 'N m s/rad', days, values, std)
            )
    return found


def changed(series, shift):
    """Return the series with something added."""
    return ParameterHistory(**{**vars(series), 'values': series.values + shift})


def judged(series):
    """Return what the tests of arms of one kind say, the least probable first."""
    return judge([(series, spreads(series))])


def names(series, alpha=0.05):
    """Return the arms that are named."""
    return {one.arm for one in judged(series) if significant(one, alpha)}


@pytest.mark.long
def test_a_thousand_healthy_arms_are_rarely_accused():
    accused = [len(names(fleet(np.random.default_rng(seed), 1000))) > 0 for seed in range(6)]
    assert np.mean(accused) <= 0.05 + 2 * np.sqrt(0.05 * 0.95 / 6)


def test_a_step_is_found_with_its_arm_parameter_place_and_size():
    series = fleet(np.random.default_rng(1), 50)
    series[8 * 7 + 3] = changed(series[8 * 7 + 3], np.where(np.arange(10) >= 6, 0.1, 0.0))
    (first, *_) = judged(series)
    change = significant(first, 0.05)[0]
    assert (first.arm, change.series.parameter) == ('arm_7', PARAMETERS[3])
    assert (change.kind, change.index) == ('step', 6)
    assert abs(change.size - 0.1) < 3 * change.std


def test_wear_is_a_trend_with_its_slope():
    series = fleet(np.random.default_rng(2), 50)
    series[0] = changed(series[0], 0.02 * np.arange(10.0))
    change = next(one for one in judged(series) if one.arm == 'arm_0').changes[0]
    assert change.kind == 'trend'
    assert abs(change.size - 0.02 * MONTH) < 3 * change.std


def test_of_the_arms_named_few_are_healthy():
    rng = np.random.default_rng(4)
    false, true = 0, 0
    for _ in range(4):
        series = fleet(rng, 200)
        for arm in range(40):
            k = 8 * arm + int(rng.integers(8))
            step = rng.choice([0.03, 0.06, 0.12])
            series[k] = changed(series[k], np.where(np.arange(10) >= 5, step, 0.0))
        found = names(series)
        sick = {f'arm_{arm}' for arm in range(40)}
        false, true = false + len(found - sick), true + len(found & sick)
    assert false <= 0.05 * (false + true) + 2 * np.sqrt(0.05 * (false + true))
    assert true > 80


def test_what_bags_differ_by_beyond_their_deviations_is_learned_from_all_arms():
    series = fleet(np.random.default_rng(5), 100, beyond=2.0)
    for spread in spreads(series).values():
        assert spread.std == pytest.approx(0.02, rel=0.15)


def test_a_day_that_all_siblings_share_is_no_change_of_any():
    series = fleet(np.random.default_rng(10), 20)
    shared = 0.2 * np.sin(np.arange(10.0))
    polished = without_days([changed(one, shared * one.values.mean()) for one in series])
    for one, before in zip(polished, series, strict=True):
        kept = one.values - one.values.mean() - (before.values - before.values.mean())
        assert np.abs(kept).max() < 0.05


@pytest.mark.long
@pytest.mark.parametrize('bags', [10, 30])
def test_healthy_arms_whose_days_differ_as_real_ones_do_are_rarely_named(bags):
    counts = [tally(120, bags, 20, np.random.default_rng([11, bags, k])) for k in range(2)]
    true, false = np.sum(counts, axis=0)
    assert false <= 0.05 * (true + false) + 2 * np.sqrt(0.05 * (true + false))
    assert true >= (10 if bags == 10 else 34)


@pytest.mark.parametrize(
    ('where', 'named'), [([0], 0), ([5], 0), ([7, 8, 9], 1), (range(3, 10), 1)]
)
def test_one_odd_bag_is_no_change_and_what_lasts_three_bags_is(where, named):
    series = fleet(np.random.default_rng(8), 50)
    for k in (16,) if named else range(0, len(series), 16):
        series[k] = changed(series[k], np.where(np.isin(np.arange(10), where), 0.5, 0.0))
    assert names(series) == ({'arm_2'} if named else set())


@pytest.mark.parametrize(('bags', 'beyond', 'lasts'), [(10, 1.0, 0.0), (40, 0.0, 0.03)])
def test_the_interval_of_wear_holds_the_truth_as_often_as_it_says(bags, beyond, lasts):
    """Scatter may last for days."""
    rng = np.random.default_rng(3)
    series = fleet(rng, 250, bags, beyond)
    walks = lasting(rng, bags, (len(series), bags))
    series = [changed(one, lasts * walk) for one, walk in zip(series, walks, strict=True)]
    spread = spreads(series)
    slopes = np.array([wear(one, spread[one.parameter]) for one in series])
    inside = np.mean(np.abs(slopes[:, 0]) < 1.96 * slopes[:, 1])
    assert inside == pytest.approx(0.95, abs=0.03)
