# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Experiments with the two-link arm, recorded in MuJoCo for independent tests."""

from armid_ros.motion import ElasticRun
from armid_ros.papers.elastic.experiments import RESONANCE_GAIN, step_experiments
from armid_ros.robots.two_link import two_link_set, TwoLinkParameters
from armid_ros.simulation.elastic import two_link_loop
import numpy as np
import pytest

from tests.papers.elastic.two_link_in_mujoco import (
    excitation,
    MANY,
    measured,
    mujoco_arm,
    run_mujoco,
)


@pytest.fixture(scope='session')
def truth() -> TwoLinkParameters:
    """Return the true parameters of the recorded arm."""
    return two_link_set('after').parameters


@pytest.fixture(scope='session')
def clean_steps(truth) -> list[ElasticRun]:
    """Return step responses without noise."""
    loop, engine = two_link_loop(two_link_set('after')), mujoco_arm(truth, MANY)
    return [run_mujoco(engine, loop, experiment) for experiment in step_experiments()]


@pytest.fixture(scope='session')
def runs(truth) -> list[ElasticRun]:
    """Return twelve noisy experiments of 4 s through the resonances."""
    rng = np.random.default_rng(3)
    loop, engine = two_link_loop(two_link_set('after'), RESONANCE_GAIN), mujoco_arm(truth)
    return [measured(run_mujoco(engine, loop, e), rng) for e in excitation(12)]
