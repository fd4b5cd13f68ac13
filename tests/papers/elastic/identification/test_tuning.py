# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fine tuning to closed-loop steps, from the set before tuning to the one after it."""

from dataclasses import replace

from armid_ros.papers.elastic.experiments import run_experiment, step_experiments
from armid_ros.papers.elastic.identification.response import (
    pack,
    sensitivities,
    Steps,
    unpack,
    velocities,
)
from armid_ros.papers.elastic.identification.three_steps import tune, Tuning
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation.elastic import two_link_loop
import numpy as np
import pytest

from tests.papers.elastic.two_link_in_mujoco import errors, measured

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
    reference, rng = step_experiments()[number], np.random.default_rng(0)
    run = run_experiment(reference, two_link_set('after'), rng)
    found = velocities(experiments, truth)[:, number]
    np.testing.assert_allclose(found[:, :2], run.motor.dq[: len(found)], atol=1e-9)
    np.testing.assert_allclose(found[:, 2:], run.link.dq[: len(found)], atol=1e-9)


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
    rng = np.random.default_rng(5)
    return tune([measured(run, rng, 0.002, 0.002) for run in clean_steps], START, LOOP)


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
