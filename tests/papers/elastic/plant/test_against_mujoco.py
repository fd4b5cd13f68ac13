# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Elastic joints against MuJoCo: other dynamics, other integration, other friction."""

from armid_ros.papers.elastic.experiments import run_experiment, step_experiments
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation.elastic import two_link_loop
import numpy as np
import pytest

from tests.papers.elastic.two_link_in_mujoco import MANY, mujoco_arm, run_mujoco


@pytest.mark.parametrize('number', [0, 3])
def test_steps_move_both_alike(number) -> None:
    """The error of MuJoCo itself at 5 us is about 1e-4 rad/s, falling with the first power."""
    shipped = two_link_set('after')
    experiment = step_experiments()[number]
    loop = two_link_loop(shipped)
    ours = run_experiment(experiment, shipped, np.random.default_rng(0))
    theirs = run_mujoco(mujoco_arm(shipped.parameters, MANY), loop, experiment)
    assert np.ptp(ours.link.dq, axis=0).max() > 1.0
    count = len(theirs.link)
    np.testing.assert_allclose(ours.link.dq[:count], theirs.link.dq, atol=3e-4)
    np.testing.assert_allclose(ours.motor.dq[:count], theirs.motor.dq, atol=3e-4)
    np.testing.assert_allclose(ours.link.q[:count], theirs.link.q, atol=5e-5)
