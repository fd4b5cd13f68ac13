# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Changes of an arm at work: seen soon, named, and nothing else forgotten."""

from __future__ import annotations

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.estimate import Estimate, ParameterName
from armid_ros.identification.online.background import at_once
from armid_ros.identification.online.change import Change, change_candidates, ChangeCandidate
from armid_ros.identification.online.change_search import (
    Block,
    score_statistics,
    ScoreStatistics,
)
from armid_ros.identification.online.change_watch import ChangeWatch, NuisanceRows, Row
from armid_ros.identification.online.null_calibration import NullCalibration
from armid_ros.identification.online.recursive import RecursiveLeastSquares, WeightedSample
from armid_ros.identification.online.settings import FALSE_ALARM_TIME
from armid_ros.identification.rows.causal import CausalMotion
from armid_ros.motion import Motion
import numpy as np
import pytest
from scipy import stats

from benchmarks import changes
from tests.identification.conftest import Foreground, multisine

NAMES = tuple(ParameterName(f'p{k}', '', '') for k in range(5))
TRUTH = np.array([1.0, -2.0, 0.5, 3.0, 0.0])
CHANGED = np.array([[0.0], [0.0], [1.0], [0.0], [0.5]])


class NoNuisance:
    """A model that lacks nothing; samples have four rows."""

    parameters = ()

    def columns(self, some):
        """Return no column."""
        yield
        return np.empty((len(some), 4, 0))


def row(t, rows, tau, weights):
    """Return a row that is made into no other."""
    return Row(t, WeightedSample(rows, tau, weights), None, 0.0, 1.0)


def learned_and_block(
    rng, delta: float, seen: int = 4, directions=CHANGED, noise=1.0
) -> tuple[RecursiveLeastSquares, Block, np.ndarray, np.ndarray]:
    """Learn from 400 rows of `seen` parameters, then take in 60 rows after a change."""
    estimator = RecursiveLeastSquares(NAMES, [1.0])
    rows = rng.normal(size=(400, 5)) * (np.arange(5) < seen)
    for row in rows:
        estimator.update(row[np.newaxis], np.atleast_1d(row @ TRUTH + rng.normal()))
    w = rng.normal(size=(60, 5))
    tau = w @ (TRUTH + delta * CHANGED[:, 0]) + rng.normal(size=60)
    learned = estimator.copied()
    products, right = w.T @ w / noise**2, w.T @ tau / noise**2
    known = learned.root.T @ learned.root
    along = products @ directions, known, known @ directions
    block = Block(0.0, 1.0, products, right, *along, learned, ())
    return estimator, block, w, tau


def statistics_of(block, directions, residual_scale=1.0):
    return at_once(score_statistics([block], block, directions, residual_scale))


@pytest.mark.parametrize('noise', [1.0, 3.0])
def test_the_size_of_a_change_is_that_of_least_squares_over_all_rows(noise):
    """Before and after in one problem, with a column for the change, in any unit of noise."""
    rng = np.random.default_rng(0)
    _, block, w, tau = learned_and_block(rng, 0.7, seen=5, noise=noise)
    found, covariance = statistics_of(block, CHANGED, noise).size(slice(0, 1))
    top = np.hstack([block.before.root, np.zeros((5, 1))])
    both = np.vstack([top, np.hstack([w, w @ CHANGED])])
    aim = np.concatenate([block.before.root @ block.before.values, tau])
    expected = np.linalg.lstsq(both, aim, rcond=None)[0][-1]
    assert found[0] == pytest.approx(expected, rel=1e-6)
    variance = noise**2 * np.linalg.inv(both.T @ both)[-1, -1]
    assert covariance[0, 0] == pytest.approx(variance, rel=1e-6)


def test_without_a_change_the_ratio_is_chi_square():
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(60):
        _, block, _, _ = learned_and_block(rng, 0.0, seen=5)
        ratios.append(statistics_of(block, CHANGED).ratios(np.array([[0]]))[0])
    assert stats.kstest(ratios, stats.chi2(1).cdf).pvalue > 1e-3


def test_what_was_never_known_cannot_be_seen_to_change():
    unknown = np.eye(5)[:, [4]]
    _, block, _, _ = learned_and_block(np.random.default_rng(2), 5.0, directions=unknown)
    assert statistics_of(block, unknown).ratios(np.array([[0]]))[0] < 1e-3


def test_reopening_forgets_one_direction_and_nothing_else():
    rng = np.random.default_rng(3)
    estimator, _, _, _ = learned_and_block(rng, 0.0, seen=5)
    before, root = estimator.values, estimator.root.copy()
    information = root.T @ root
    estimator.forget_directions(CHANGED)
    np.testing.assert_allclose(estimator.values, before, rtol=1e-6)
    after = estimator.root.T @ estimator.root
    unit = CHANGED / np.linalg.norm(CHANGED)
    assert (unit.T @ after @ unit).item() < 1e-6
    lost = information @ unit
    np.testing.assert_allclose(
        after, information - lost @ lost.T / (unit.T @ lost), atol=1e-6 * information.max()
    )


def test_a_statistic_that_is_usually_large_is_not_surprising():
    rng = np.random.default_rng(4)
    usual, strength = NullCalibration([1, 3], 1, 2), np.ones(4)
    for _ in range(400):
        ratios = 100.0 * np.array([rng.chisquare(1), rng.chisquare(3)])
        at_once(usual.update(ratios, strength))
    np.testing.assert_allclose(usual.factors, 100.0, rtol=0.3)
    assert np.all(usual.excess(np.array([2000.0, 2500.0]), strength, 1e-8) < 1.0)
    large = np.array([8000.0, 9000.0])
    assert np.all(usual.excess(large, strength, 1e-8) > 1.0)
    assert np.all(usual.excess(large, 9.0 * strength, 1e-8) < 1.0)  # a faster motion


def test_candidates_are_every_effect_the_friction_of_a_joint_and_a_load():
    online = changes.watch(iter(()))
    found = change_candidates(online.arm, online.base)
    names = {(c.name, c.joint) for c in found}
    assert ('payload', 'wrist_pitch') in names and ('friction', 'elbow_pitch') in names
    assert ('torque_offset', 'shoulder_roll') in names
    payload = next(c for c in found if c.name == 'payload')
    assert payload.parameters[0].name == 'payload_m'
    np.testing.assert_allclose(
        payload.directions[:, 0],
        online.base.values(
            np.eye(len(online.arm.theta))[[p.name for p in online.arm.parameters].index('m6')]
        ),
    )


#: The simulation of the benchmark, at a rate that takes a fifth of its time [Hz].
RATE = 200.0


@pytest.mark.long
@pytest.mark.parametrize(
    ('change', 'before', 'name', 'truth'),
    [
        ('payload:' + changes.ball(0.3), 30.0, 'payload', 0.3),
        ('coulomb_friction@shoulder_pitch:coulomb_torque=0.1', 30.0, 'coulomb_friction', 0.1),
        pytest.param(
            *('coulomb_friction@elbow_pitch:coulomb_torque=0.08', 60.0, 'coulomb_friction', 0.08),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_change_in_mid_motion_is_seen_and_nothing_else_forgotten(change, before, name, truth):
    seen_at, known = None, None
    online = changes.watch(iter(()))
    for t, q, tau in changes.changing(change, 0, before, 3.0, RATE):
        online.update(t, q, None, tau)
        if known is None and t >= before:
            known = online.estimate()
        if seen_at is None and online.changes:
            seen_at = t
    (found,) = online.changes
    assert before < seen_at < before + changes.WANTED
    assert abs(found.t - before) < 0.5
    assert found.candidate.name == name
    lower, upper = found.size.interval(0.999)[0]
    assert 0.0 < lower < truth < upper
    still = online.estimate()
    others = [
        k
        for k, p in enumerate(known.parameters)
        if p.name == 'viscous_coefficient' and p.joint != found.candidate.joint
    ]
    assert np.all(still.std[others] < 1.5 * known.std[others])
    moved = np.abs(still.values[others] - known.values[others])
    assert np.all(moved < 4.0 * known.std[others])


@pytest.mark.long
def test_work_without_a_change_raises_no_alarm():
    assert not changes.watch(changes.unchanging(2, 1, RATE)).changes


@pytest.mark.slow
def test_a_motion_without_noise_raises_no_alarm(arm):
    """What filtering leaves of it is anything but normal: nothing, and much at reversals."""
    motion = multisine(arm.robot.joints, 12.0, 250.0, seed=0)
    online = changes.watch(zip(motion.t, motion.q, arm.torque(motion), strict=True))
    assert not online.changes


def stepped(seed, louder=1.0, rests=False):
    """Return the changes that are seen of a step after 25 s, in a model of three parameters."""
    rng, truth = np.random.default_rng(seed), np.array([1.0, -2.0, 0.5])
    parameters = tuple(ParameterName(f'p{k}', '', '') for k in range(3))
    step = np.array([[0.0], [0.0], [1.0]])
    candidate = ChangeCandidate('friction', 'elbow', parameters[2:], step, step)
    estimator = RecursiveLeastSquares(parameters, np.ones(4))
    watch = ChangeWatch(estimator, NoNuisance(), [candidate], FALSE_ALARM_TIME, Foreground())
    for k in range(6000):
        after, rows = k >= 5000, rng.normal(size=(4, 3))
        noise = rng.normal(size=4) * (louder if after else 1.0)
        tau = rows @ (truth + 5.0 * after * step[:, 0]) + noise
        weights = np.zeros(4) if rests and k > 5120 else np.ones(4)
        watch.update(row(0.005 * k, rows, tau, weights))
    return watch.changes


def test_a_window_that_the_model_fits_worse_than_usual_says_less_of_the_size():
    """The same change, and noise three times as loud from then on."""
    widths = []
    for louder in (1.0, 3.0):
        (change,) = stepped(7, louder)
        assert change.t == pytest.approx(25.0, abs=0.26)
        lower, upper = change.size.interval(0.999)[0]
        assert lower < 5.0 < upper
        widths.append(upper - lower)
    assert 2.0 < widths[1] / widths[0] < 4.0  # one window may be a block longer


@pytest.mark.parametrize('rests', [True, False])
def test_what_shows_for_a_moment_before_an_arm_rests_is_no_change(rests):
    """A misfit of the slow motion in which an arm comes to rest, or a change that goes on."""
    assert len(stepped(8, rests=rests)) == (0 if rests else 1)


def test_what_a_window_does_not_show_has_an_infinite_deviation():
    """The first change is not seen at all; the last two are seen only in their sum."""
    rows = np.array([[0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]])
    score = ScoreStatistics(rows.T @ rows, rows.T @ [2.0, 3.0], np.ones(4))
    values, covariance = score.size(slice(None))
    np.testing.assert_allclose(np.diag(covariance), [np.inf, 0.25, np.inf, np.inf])
    assert values[1] == pytest.approx(1.0)
    candidate = ChangeCandidate('friction', 'elbow', NAMES[:2], np.eye(2), np.eye(2))
    size = Estimate(NAMES[:2], values[:2], covariance[:2, :2])
    unknown, known = str(Change(candidate, (), 1.0, size)).split(',')
    assert 'unknown' in unknown and 'inf' not in unknown and '+1' in known


def test_columns_of_nuisance_are_those_of_the_effects_that_the_arm_lacks(robot):
    arm = ArmModel(robot)
    stribeck = make_effect('stribeck_friction', robot)
    names = ('viscous_friction', 'coulomb_friction', 'load_dependent_friction')
    viscous, coulomb, loaded = (make_effect(name, robot) for name in names)
    humps = [stribeck.with_shape((velocity, 2.0)) for velocity in (0.03, 0.1, 0.3)]
    lacking = viscous, coulomb, *humps, loaded
    q, dq, ddq = 0.2 * np.random.default_rng(0).normal(size=(3, robot.n_joints))
    nuisance = NuisanceRows(arm, 5.0)
    # the first row of a stretch, which filters leave as it is
    row = Row(0.0, None, CausalMotion(0.0, q, dq, ddq, q), 0.005, 1.0, begins=True)
    one = Motion(robot.joints, np.zeros(1), q[None], dq[None], ddq[None])
    (rows,) = at_once(nuisance.columns([row]))
    expected = np.concatenate([effect.columns(one, arm)[0] for effect in lacking], axis=1)
    np.testing.assert_allclose(rows, expected, atol=1e-12)
    assert [p.joint for p in nuisance.parameters] == list(robot.joints) * len(lacking)
    whole = NuisanceRows(ArmModel(robot, (viscous, coulomb, stribeck, loaded)), 5.0)
    assert whole.parameters == ()
    assert at_once(whole.columns([row])).shape == (1, robot.n_joints, 0)
