# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How sure a candidate is: p values that hold for all that was tried, and resamplings."""

from types import SimpleNamespace

from armid_ros.diagnosis import diagnose
from armid_ros.diagnosis.league import adjusted_p_values, inclusion_frequencies, p_value
from armid_ros.diagnosis.selection import Score, Trial
from armid_ros.diagnosis.settings import DiagnosisSettings
import numpy as np
import pytest
from scipy import stats

BLOCKS = 12


def trial(blocks, effect='viscous_friction', only=None):
    """Return a candidate that takes these sums of squares, shape (F, blocks)."""
    blocks = np.asarray(blocks, dtype=float)
    spread = blocks.std(axis=1, ddof=1) / np.sqrt(blocks.shape[1])
    group = SimpleNamespace(
        effect=SimpleNamespace(name=effect, joints=('elbow',), shapes=()),
        kept=(0,),
        key=(effect, ('elbow',), (0,)),
    )
    score = Score(group, np.ones(1), np.ones(1), blocks.sum(), 1.0)
    nothing = np.zeros((0, 1))
    gains = blocks.sum(axis=1, keepdims=True)
    z = blocks.mean(axis=1) / np.maximum(spread, 1e-300)
    values = np.ones((len(blocks), 1))
    return Trial(score, nothing, nothing, gains, z, blocks, values, only, np.zeros(1))


def test_noise_seldom_makes_any_of_many_candidates_significant():
    rng = np.random.default_rng(0)
    least = []
    for _ in range(300):
        trials = [trial(rng.normal(size=(3, BLOCKS))) for _ in range(20)]
        least.append(adjusted_p_values(trials, 20).min())
    low, high = stats.binomtest(int(np.sum(np.array(least) < 0.05)), 300).proportion_ci()
    assert low < 0.05 < high


def test_p_of_one_part_is_that_of_students_t():
    blocks = np.random.default_rng(1).normal(0.5, 1.0, size=(1, BLOCKS))
    expected = stats.ttest_1samp(blocks[0], 0.0, alternative='greater').pvalue
    assert p_value(trial(blocks)) == pytest.approx(expected, rel=1e-9)


def test_parts_that_cannot_show_a_candidate_say_nothing_of_it():
    alone = np.random.default_rng(2).normal(1.0, 1.0, size=(1, BLOCKS))
    among = np.vstack([np.zeros((2, BLOCKS)), alone])
    assert p_value(trial(among)) == pytest.approx(p_value(trial(alone)))
    assert p_value(trial(np.zeros((3, BLOCKS)))) == 1.0


def test_holm_counts_all_that_was_tried_and_keeps_the_order():
    rng = np.random.default_rng(3)
    trials = [trial(rng.normal(shift, 1.0, size=(3, BLOCKS))) for shift in (0.0, 1.0, 0.6, 0.1)]
    p = np.array([p_value(t) for t in trials])
    adjusted = adjusted_p_values(trials, 50)
    order = np.argsort(p)
    assert adjusted[order[0]] == pytest.approx(min(50 * p[order[0]], 1.0))
    assert adjusted[order[1]] == pytest.approx(min(49 * p[order[1]], 1.0))
    assert np.all(np.diff(adjusted[order]) >= 0.0)
    assert np.all(adjusted <= 1.0)


def test_what_is_barely_replicated_is_in_some_resamplings_only(bench):
    rng = np.random.default_rng(4)
    noise = rng.normal(size=(3, BLOCKS))
    noise -= noise.mean(axis=1, keepdims=True)
    unit = np.sqrt(BLOCKS) / noise.std(axis=1, ddof=1, keepdims=True)
    barely = noise * unit + np.array([[3.1], [3.1], [0.5]])
    sure = noise * unit + 12.0
    for blocks, low, high in ((barely, 0.1, 0.9), (sure, 0.99, 1.0)):
        (share,) = inclusion_frequencies(
            [[trial(blocks)]], bench.arm, DiagnosisSettings(), np.random.default_rng(5)
        ).values()
        assert low <= share <= high


def test_the_name_of_an_effect_that_is_there_is_sure(bench):
    hidden = bench.recordings(lambda m, tau: np.outer(m.dq[:, 1] * np.abs(m.dq[:, 1]), [0, 0.02]))
    found = diagnose(bench.arm, hidden, rng=np.random.default_rng(0))
    (named,) = found.league.named
    assert named.trial.score.group.key[:2] == ('quadratic_friction', ('elbow',))
    assert named.adjusted_p < 1e-3
    assert named.inclusion > 0.9
    others = [s for s in found.league.first if s.trial is not named.trial]
    assert sum(s.inclusion for s in others) < 0.1


@pytest.mark.parametrize('seed', [1, 2, 3, 4])
def test_no_candidate_is_significant_where_nothing_is_hidden(bench, seed):
    found = diagnose(bench.arm, bench.recordings(seed=seed), rng=np.random.default_rng(0))
    assert found.league.first
    assert min(s.adjusted_p for s in found.league.first) > 0.05
    assert not any(s.inclusion for s in found.league.first)
