# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A gait with feet that stay where they stand."""

from armid_ros.papers.exo.plant.gait import read_gait
from armid_ros.papers.exo.plant.walkers import (
    foot_points,
    HEEL_DOWN,
    LegLength,
    TOE_DOWN,
    walkable,
)
import numpy as np
import pytest

LEG = LegLength(thigh=0.3605, shank=0.3854, foot=0.2572)


@pytest.fixture(scope='module')
def plan():
    return walkable(read_gait(), LEG, 1.2)


def feet(plan):
    phase = np.arange(len(plan.hips)) / len(plan.hips)
    way = np.outer(phase, [plan.stride, 0.0])
    return phase, *foot_points(plan.gait(phase), plan.hips + way, plan.lean, LEG)


def test_heel_and_toe_stay_where_they_stand(plan) -> None:
    phase, heel, toe = feet(plan)
    for point, place, (begin, end) in (
        (heel, [0.0, 0.0], HEEL_DOWN),
        (toe, [LEG.foot, 0.0], TOE_DOWN),
    ):
        down = (phase >= begin) & (phase <= end)
        np.testing.assert_allclose(point[down], np.tile(place, (down.sum(), 1)), atol=2e-3)


def test_the_swing_foot_clears_the_ground(plan) -> None:
    phase, heel, toe = feet(plan)
    swing = (phase > 0.68) & (phase < 0.92)
    assert min(heel[swing, 1].min(), toe[swing, 1].min()) > 0.01


def test_curves_of_hip_and_knee_stay_near_those_asked_for(plan) -> None:
    phase = np.linspace(0.0, 1.0, 101)
    off = np.degrees(plan.gait(phase) - read_gait()(phase))[:, :2]
    assert np.sqrt(np.mean(off**2, axis=0)).max() < 3.0
