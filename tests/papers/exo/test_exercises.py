# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motions that a person can give."""

from __future__ import annotations

from armid_ros.papers.exo.plant.exercises import exercise, EXERCISES
from armid_ros.papers.exo.plant.leg_pair import leg_pair
import numpy as np
import pytest

from benchmarks.exo_motions import bound

PAIR = leg_pair()
T = np.linspace(0.0, 2.0, 2001)


@pytest.mark.parametrize('name', EXERCISES)
def test_velocity_and_acceleration_are_those_of_the_position(name) -> None:
    for motion in exercise(PAIR, name, T):
        speed = np.gradient(motion.q, T, axis=0)[5:-5]
        hurry = np.gradient(motion.dq, T, axis=0)[5:-5]
        np.testing.assert_allclose(motion.dq[5:-5], speed, atol=2e-3)
        np.testing.assert_allclose(motion.ddq[5:-5], hurry, atol=3e-2)


@pytest.mark.parametrize('name', EXERCISES)
def test_knees_bend_one_way_and_the_stance_foot_is_flat(name) -> None:
    wearer = exercise(PAIR, name, T).other
    ankle, knee, hip, _, far_knee, _ = wearer.q.T
    assert min(knee.min(), far_knee.min()) > -0.05
    np.testing.assert_allclose(ankle, knee - hip, atol=1e-12)


def test_quick_steps_tell_the_springs_best() -> None:
    """The machine follows late, so that quick steps draw the straps out further."""
    worst = {name: bound(name, 60).max() for name in ('step', 'quick_step', 'squat', 'rock')}
    assert min(worst, key=worst.__getitem__) == 'quick_step'
    assert worst['quick_step'] < 0.6 * worst['step']
