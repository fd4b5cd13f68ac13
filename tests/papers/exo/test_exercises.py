# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motions that a person can give."""

from armid_ros.papers.exo.plant.leg_pair import exercise, EXERCISES, leg_pair
import numpy as np
import pytest

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
