# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fine tuning to closed-loop steps, from the set before tuning to the one after it."""

from dataclasses import replace

from armid_ros.papers.elastic.identification.response import (
    pack,
    ringing,
    sensitivities,
    Steps,
    unpack,
    velocities,
)
from armid_ros.papers.elastic.identification.three_steps import tune, Tuning
from armid_ros.papers.elastic.plant import ElasticSensors, run_elastic, step_experiments
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation.elastic import two_link_loop, two_link_plant
import numpy as np
import pytest

from tests.papers.elastic.two_link_in_mujoco import errors

pytestmark = pytest.mark.long

LOOP = two_link_loop(two_link_set('after'))
START = two_link_set('before').parameters


@pytest.fixture(scope='module')
def experiments(clean_steps) -> Steps:
    """Return the experiments to be simulated."""
    return Steps.of(clean_steps, LOOP)


@pytest.mark.parametrize('number', range(4))
def test_simulation_is_that_of_the_plant(experiments, truth, number) -> None:
    """The same scheme, written for the links' equations and for any URDF."""
    run = run_elastic(two_link_plant(truth), LOOP, step_experiments()[number])
    found = velocities(experiments, truth)[:, number]
    np.testing.assert_allclose(found[:, :2], run.motor.dq, atol=1e-9)
    np.testing.assert_allclose(found[:, 2:], run.link.dq, atol=1e-9)


def test_derivatives_are_exact(experiments) -> None:
    """Against central differences, whose own error is about 1e-5 where friction sticks."""
    values = np.concatenate([unpack(START), START.coulomb])

    def at(point):
        return replace(pack(point[:-2], START), coulomb=point[-2:])

    _, slopes = sensitivities(experiments, START, np.diag(values))
    for k in range(len(values)):
        step = np.zeros(len(values))
        step[k] = 1e-6 * values[k]
        ends = [velocities(experiments, at(values + s * step)) for s in (1.0, -1.0)]
        difference = (ends[0] - ends[1]) / 2e-6
        error = np.abs(difference - slopes[..., k]).max()
        assert error < 1e-4 * np.abs(slopes[..., k]).max()


@pytest.fixture(scope='module')
def tuned(clean_steps) -> Tuning:
    """Return the tuning to steps with noise of 0.002 rad/s."""
    sensors = ElasticSensors(motor_velocity=0.002, link_velocity=0.002)
    rng = np.random.default_rng(5)
    return tune([sensors.measure(run, rng) for run in clean_steps], START, LOOP)


def test_small_noise(clean_steps, truth, tuned) -> None:
    true = np.stack([run.link.dq[:, 0] for run in clean_steps], axis=1)
    before, after = (np.linalg.norm(x[:, :, 2] - true) for x in (tuned.before, tuned.after))
    found = errors(tuned.parameters, truth)
    assert found['main'] < 1.0
    assert found['dg'] < 6.0
    assert found['sum'] < 2.0
    assert after < before / 150.0


def test_intervals_hold_the_truth(truth, tuned) -> None:
    """All thirteen, the split of friction between motor and link included."""
    off = np.abs(tuned.estimate.values - unpack(truth)) / tuned.estimate.std
    assert np.all(off < 4.0)
    assert np.sqrt(np.mean(off**2)) < 2.0


def test_an_arm_that_still_rings_has_no_other_springs_for_it(
    clean_steps, experiments, truth
) -> None:
    """Without noise deviations are tiny, and what a stand leaves is far beyond them."""
    rng = np.random.default_rng(7)
    rest = rng.normal(size=(len(clean_steps), 4)) * [1e-6, 1e-6, 1e-4, 1e-4]
    seen = velocities(experiments, truth)
    seen = seen + np.einsum('necr,er->nec', ringing(experiments, truth), rest)
    seen = seen + 1e-6 * rng.normal(size=seen.shape)
    runs = [
        replace(
            run,
            motor=replace(run.motor, dq=seen[:, number, :2]),
            link=replace(run.link, dq=seen[:, number, 2:]),
        )
        for number, run in enumerate(clean_steps)
    ]
    found = tune(runs, replace(truth, stiffness=1.01 * truth.stiffness), LOOP)
    np.testing.assert_allclose(found.parameters.stiffness, truth.stiffness, rtol=1e-5)
    off = np.abs(found.estimate.values - unpack(truth)) / found.estimate.std
    assert np.all(off < 4.0)
