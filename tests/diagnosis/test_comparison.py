# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The evidence of causes is that of normal distributions, written out here."""

from dataclasses import replace
from types import SimpleNamespace

from armid_ros.diagnosis.data.rows import Rows
from armid_ros.diagnosis.data.trajectory import trajectories
from armid_ros.diagnosis.search.candidates import Causes, value_unit
from armid_ros.diagnosis.search.comparison import CauseComparison
from armid_ros.diagnosis.search.hyperparameters import Hyperparameters
from armid_ros.diagnosis.search.nuisance import Nuisance
from armid_ros.diagnosis.search.odds import (
    CauseFit,
    fit_cause,
    log_probability_in_bounds,
    marginalised,
    NO_SPREAD,
)
from armid_ros.diagnosis.settings import DiagnosisSettings, SIZES, THERE
from armid_ros.effects import CATALOGUE
from armid_ros.identification.rows.signals import Conditioning
import numpy as np
import pytest
from scipy import linalg, stats

USED = Conditioning(200.0, 5.0, 20)
MISFIT = np.array([0.2, 0.1])


@pytest.fixture(scope='module', params=[False, True], ids=['other motions', 'a repeated motion'])
def nuisance(bench, request):
    """Return two recordings of one day and one of the next, of an arm with a dirty elbow."""
    recordings = bench.recordings(lambda motion, tau: 0.3 * np.sin(3.0 * motion.q), seed=3)
    if request.param:
        later = slice(100, None)  # the next day repeats a motion, recorded half a second later
        noise = 0.1 * np.random.default_rng(4).normal(size=recordings[0].tau.shape)
        again = replace(recordings[0], tau=recordings[0].tau + noise)
        recordings[2] = replace(again, t=again.t[later], q=again.q[later], tau=again.tau[later])
    data = tuple(trajectories(recordings, USED))
    rows = Rows(data, (MISFIT,) * 3, 2, (MISFIT,) * 3)
    assert rows.repeated == [[0, 2]] * request.param
    return Nuisance.of(rows, bench.arm, np.random.default_rng(0))


def covariance(nuisance, hyperparameters, more=()):
    """Return the covariance of all informative rows, and which these are."""
    use = [np.any(x != 0.0, axis=2).ravel() for x in nuisance.columns]
    flat = [x.reshape(-1, x.shape[2]) for x in nuisance.columns]
    rank, functions = nuisance.base.rank, nuisance.discrepancy.shape[1]
    body = np.linalg.inv(nuisance.prior_precision)
    unit = np.repeat(MISFIT, functions)
    whole = np.concatenate(flat)
    reach = nuisance.unvisited_factor.ravel()
    shared = linalg.block_diag(body, np.diag((hyperparameters.shared * unit * reach) ** 2))
    whole = whole[:, : rank + len(unit)]
    total = whole @ shared @ whole.T + hyperparameters.noise**2 * np.eye(len(whole))
    own = whole[:, rank:] * hyperparameters.own * unit
    recording = np.repeat(range(len(flat)), [len(x) for x in flat])
    total += (own @ own.T) * nuisance.rows.similarity[np.ix_(recording, recording)]
    for columns, size in more:
        total += size**2 * columns @ columns.T
    told = np.concatenate(use)
    return total[np.ix_(told, told)], told


def density(nuisance, hyperparameters, more=()):
    """Return the log density of the residual."""
    total, told = covariance(nuisance, hyperparameters, more)
    y = np.concatenate([rest.ravel() for rest in nuisance.residual])[told]
    return stats.multivariate_normal(np.zeros(len(y)), total).logpdf(y)


def columns_of(cause, nuisance):
    """Return all rows of the columns of a cause, (S, p), over its unit."""
    parts = []
    for own, rest in zip(cause.columns, nuisance.residual, strict=True):
        x = np.zeros((*rest.shape, len(cause.unit)))
        x[list(cause.joints)] = own * cause.unit
        parts.append(x.reshape(-1, len(cause.unit)))
    return parts


def test_settings_are_compared_by_the_density_of_the_data(nuisance):
    settings = [
        Hyperparameters(1.0, 0.4, 0.3, 0.7, 1.0),
        Hyperparameters(True, 1.2, 0.8, 0.4, 1.0),
    ]
    one, other = (nuisance.posterior(hyperparameters).evidence for hyperparameters in settings)
    first, second = (density(nuisance, hyperparameters) for hyperparameters in settings)
    assert one - other == pytest.approx(first - second, rel=1e-4, abs=1e-3)


def causes_of(nuisance, posterior, *names):
    kinds = tuple(CATALOGUE[name] for name in names)
    return Causes(kinds, nuisance, True, frozenset()).causes(nuisance, posterior)


def test_the_factor_of_a_cause_is_the_ratio_of_densities(nuisance):
    hyperparameters = Hyperparameters(1.0, 0.4, 0.3, 0.7, 1.0)
    posterior = nuisance.posterior(hyperparameters)
    for cause in causes_of(nuisance, posterior, 'torque_offset', 'viscous_friction'):
        parts = columns_of(cause, nuisance)
        there = np.concatenate(parts)
        today = np.concatenate([*(0.0 * x for x in parts[:2]), parts[2]])
        nothing = density(nuisance, hyperparameters, [(there, THERE)])
        each = [density(nuisance, hyperparameters, [(there, THERE), (today, s)]) for s in SIZES]
        expected = np.logaddexp.reduce(each) - np.log(len(SIZES)) - nothing
        fit = fit_cause(cause, nuisance, posterior, 0.0, NO_SPREAD)
        assert fit.factor == pytest.approx(expected, rel=1e-3, abs=1e-2)


def test_an_accepted_cause_is_explained_as_if_it_were_data_of_the_model(nuisance):
    """Beside itself a cause has nothing left to explain."""
    hyperparameters = Hyperparameters(1.0, 0.4, 0.3, 0.7, 1.0)
    posterior = nuisance.posterior(hyperparameters)
    first, _ = causes_of(nuisance, posterior, 'torque_offset')
    beside = nuisance.and_cause(first, 1.0)
    again = fit_cause(first, beside, beside.posterior(hyperparameters))
    assert again.explained < 0.5
    assert beside.without_cause(0).accepted == ()


def test_what_is_integrated_out_is_what_a_normal_distribution_leaves():
    rng = np.random.default_rng(0)
    rows, root = rng.normal(size=(40, 5)), rng.normal(size=(5, 3))
    y = rng.normal(size=40)
    square, aim, gained = marginalised(rows.T @ rows, rows.T @ y, root)
    total = np.eye(40) + rows @ root @ root.T @ rows.T
    inverse = np.linalg.inv(total)
    np.testing.assert_allclose(square, rows.T @ inverse @ rows, atol=1e-9)
    np.testing.assert_allclose(aim, rows.T @ inverse @ y, atol=1e-9)
    expected = 0.5 * (y @ y - y @ inverse @ y) - 0.5 * np.linalg.slogdet(total)[1]
    assert gained == pytest.approx(expected)


@pytest.mark.parametrize('joints', [[1], [0, 2], [0, 1, 2]])
def test_a_family_has_the_joints_of_the_largest_evidence(upright, joints):
    """Drag of one joint is no family; that of two of three is one, and has no third."""
    size = 0.2 * np.isin(range(3), joints)
    days = [
        upright.recordings(seed=1),
        upright.recordings(lambda motion, tau: size * motion.dq, seed=2),
    ]
    data = trajectories([*days[0], *days[1]], USED)
    misfit = np.full(3, 0.05)
    rows = Rows(tuple(data), (misfit,) * 6, 3, (misfit,) * 6)
    nuisance = Nuisance.of(rows, upright.arm, np.random.default_rng(0))
    posterior = nuisance.posterior(Hyperparameters(1.0, 0.4, 0.3, 0.7, 1.0))
    causes = causes_of(nuisance, posterior, 'viscous_friction')
    families = [one for one in causes if len(one.effect.joints) > 1]
    wanted = tuple(upright.robot.joints[k] for k in joints)
    assert [one.effect.joints for one in families] == ([wanted] if len(joints) > 1 else [])
    for one in families:
        assert fit_cause(one, nuisance, posterior).values == pytest.approx(size[joints], abs=0.02)


def test_every_value_of_a_cause_has_to_be_possible(upright):
    """The last joint has 0.3 N m of Coulomb friction to lose."""
    effect = CATALOGUE['coulomb_friction'].on(upright.robot)
    cause = SimpleNamespace(effect=effect, kept=(0, 1, 2), unit=np.ones(3))
    nuisance = SimpleNamespace(arm=upright.arm)
    for value, possible in ((-0.2, True), (-0.6, False)):
        values = np.array([0.5, 0.3, value])
        fit = CauseFit(0.0, 0.0, 1.0, values, np.full(3, 0.01), np.ones(3))
        assert (log_probability_in_bounds(cause, fit, nuisance) > -10.0) == possible


def test_earlier_causes_without_significance_are_dropped(nuisance):
    hyperparameters = Hyperparameters(1.0, 0.4, 0.3, 0.7, 1.0)
    posterior = nuisance.posterior(hyperparameters)
    first, last = causes_of(nuisance, posterior, 'torque_offset')
    for order in ((first, last), (last, first)):
        both = nuisance
        for cause in order:
            both = both.and_cause(cause, 1.0)
        comparison = CauseComparison(both, None, DiagnosisSettings(), (hyperparameters,))
        accepted, left = comparison._drop_redundant(list(order), both)
        assert accepted == [order[1]] and len(left.accepted) == 1


def test_a_value_that_motion_hardly_shows_has_a_possible_size(nuisance):
    """Gravity almost along an axis: an encoder offset of a million turns would explain a gap."""
    effect = CATALOGUE['encoder_offset'].on(nuisance.arm.robot, ('elbow',))
    columns = [np.full((*part.unsure.shape, 1), 1e-6) for part in nuisance.rows.data]
    unit = value_unit(nuisance, effect, (0,), nuisance.rows.rms_of_diagnosed(columns))
    assert unit.item() == effect.quantities[0].largest('elbow', nuisance.arm.robot) < np.pi
