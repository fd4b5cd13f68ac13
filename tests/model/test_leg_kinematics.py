# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The seven-link body: D-H rows, closed formulas and descriptions are one geometry."""

from __future__ import annotations

from dataclasses import astuple

from armid_ros.model import point_motion
from armid_ros.papers.exo.plant.shares import trunk_shares
from armid_ros.robots import load_robot
import numpy as np
import pytest

from .leg_kinematics import leg_centroids, leg_frames, LegAngles, LegLengths


def random_angles(rng: np.random.Generator) -> LegAngles:
    return LegAngles(*rng.uniform(-1.5, 1.5, 6))


def test_dh_rows_are_the_centroid_formulas() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        angles = random_angles(rng)
        lengths = LegLengths(*rng.uniform(0.1, 0.6, 6), pelvis=rng.uniform(0.0, 0.2))
        frames = leg_frames(angles, lengths)
        ankle, knee, hip, middle, other_hip, other_knee, other_ankle = frames[:7, :2, 3]
        shank, thigh = lengths.shank, lengths.thigh
        on_shank = lengths.shank_centroid / shank
        on_thigh = lengths.thigh_centroid / thigh
        expected = (
            ankle + on_shank * (knee - ankle),
            knee + on_thigh * (hip - knee),
            middle + np.array([0.0, lengths.trunk_centroid]),
            other_knee + on_thigh * (other_hip - other_knee),
            other_ankle + on_shank * (other_knee - other_ankle),
        )
        found = astuple(leg_centroids(angles, lengths))
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize('name', ['human_legs', 'exoskeleton_legs'])
def test_descriptions_are_the_formulas_with_a_flat_foot_and_an_upright_trunk(name) -> None:
    robot = load_robot(name)
    levers = [np.array(body.lever) for body in robot.model.inertias[1:]]
    lengths = LegLengths(0.2572, 0.3854, 0.3605, levers[0][2], levers[1][2], levers[2][2])
    rng = np.random.default_rng(1)
    for _ in range(20):
        hip, knee, *swing = rng.uniform(-1.0, 1.5, 5)
        q = np.array([[knee - hip, knee, hip, *swing]])
        angles = LegAngles(hip, knee, knee - hip, *(np.asarray(a) for a in swing))
        found = [
            point_motion(robot, joint, lever, q)[0][0, [0, 2]]
            for joint, lever in zip(robot.joints, levers, strict=True)
        ]
        formulas = astuple(leg_centroids(angles, lengths))
        np.testing.assert_allclose(found[:5], formulas, rtol=0.0, atol=1e-12)
        toe, _ = point_motion(robot, robot.joints[5], (0.2572, 0.0, 0.0), q)
        np.testing.assert_allclose(
            toe[0, [0, 2]], leg_frames(angles, lengths)[-1, :2, 3], rtol=0.0, atol=1e-12
        )


def test_the_trunk_rests_on_the_leg_that_is_nearer() -> None:
    trunk, far, near = np.array([[0.0, 1.0], [0.3, 0.0], [0.1, 0.2]])
    swing, stance = trunk_shares(trunk, far, near)
    assert swing + stance == pytest.approx(1.0)
    assert swing == pytest.approx(np.hypot(0.1, 0.8) / (np.hypot(0.3, 1.0) + np.hypot(0.1, 0.8)))
    assert swing < 0.5
    assert trunk_shares(trunk, near, near)[0] == pytest.approx(0.5)
