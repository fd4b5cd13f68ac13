# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The man, his exoskeleton, and what was assumed of both."""

from armid_ros.papers.exo.plant.gait import read_assumptions
from armid_ros.robots import load_robot, Robot
import numpy as np
import pytest

#: Table 2: length [mm], mass [kg], centroid from the far end [mm], inertia [kg mm^2].
TABLE = {
    'head': (323.7, 5.9, 127.8, 32866.1),
    'trunk': (623.1, 30.0, 280.4, 447026.8),
    'arm': (796.3, 3.5, 410.7, 16403.8),
    'thigh': (360.5, 9.8, 267.0, 163719.1),
    'shank': (385.4, 3.1, 224.7, 25751.1),
    'foot': (257.2, 0.9, 39.0, 3934.3),
}


def total_mass(robot: Robot) -> float:
    return sum(body.mass for body in robot.model.inertias)  # the fixed foot is the first


def test_the_man_is_the_table() -> None:
    robot = load_robot('human_legs')
    assert total_mass(robot) == pytest.approx(70.5, abs=1e-9)
    bodies = list(robot.model.inertias)[1:]
    for body, name in zip(bodies, ('shank', 'thigh', '', 'thigh', 'shank', 'foot'), strict=True):
        if name:
            length, mass, centroid, inertia = TABLE[name]
            assert body.mass == mass
            assert 1e6 * body.inertia[1, 1] == pytest.approx(inertia)
            reach = 1e3 * np.abs(body.lever).max()
            assert min(abs(reach - centroid), abs(length - reach - centroid)) < 1e-9


def test_head_trunk_and_arms_are_one_body() -> None:
    robot = load_robot('human_legs')
    trunk = robot.model.inertias[3]
    parts = [  # mass, height above the hip, inertia
        (30.0, 280.4, 447026.8),
        (5.9, 623.1 + 127.8, 32866.1),
        (7.0, 623.1 - (796.3 - 410.7), 2.0 * 16403.8),
    ]
    mass = sum(m for m, _, _ in parts)
    height = sum(m * z for m, z, _ in parts) / mass
    inertia = sum(i + m * (z - height) ** 2 for m, z, i in parts)
    assert trunk.mass == pytest.approx(mass)
    assert 1e3 * trunk.lever[2] == pytest.approx(height, rel=1e-5)
    assert 1e6 * trunk.inertia[1, 1] == pytest.approx(inertia, rel=1e-5)


def test_the_exoskeleton_is_what_was_assumed() -> None:
    robot, known = load_robot('exoskeleton_legs'), read_assumptions()
    assert total_mass(robot) == pytest.approx(known['exoskeleton_mass'].value)
    mass, centroid = known['segment_mass'].value, known['segment_centroid'].value
    length = known['segment_length'].value
    for link, body in zip(robot.links, list(robot.model.inertias)[1:], strict=True):
        segment = link.split('_')[-1]
        assert body.mass == pytest.approx(mass[segment])
        if segment != 'trunk':
            reach = np.abs(body.lever).max()
            ends = (centroid[segment], length[segment] - centroid[segment])
            assert min(abs(reach - end) for end in ends) < 1e-9
