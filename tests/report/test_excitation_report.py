# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The page about a planned run says what it will show, and that it is fit to run."""

from dataclasses import replace
import json
from pathlib import Path
import re

from armid_ros.api.excitation import ExcitationResult
from armid_ros.excitation import (
    CollisionScene,
    DesignProblem,
    DesignSettings,
    evaluate,
    Floor,
    Obstacle,
    with_obstacles,
)
from armid_ros.excitation.geometry.floor import floor_obstacles
from armid_ros.excitation.scene import PARTLY
from armid_ros.report.arm_drawing import draw_poses, OBSTACLE
from armid_ros.robots import collision_model, load_robot
import numpy as np
import pytest

from tests.clearance import path_clearance

TABLE = Obstacle('table <b>', 'box', (1.0, 1.0, 0.1), (0.0, 0.0, -1.5))


@pytest.fixture(scope='module')
def planned(case):
    """Return what evaluating the excitation of the case gives."""
    settings = DesignSettings(period=8.0, n_periods=1)
    return evaluate(
        DesignProblem.of(case.truth, settings, np.random.default_rng(1)), case.excitation
    )


def scene_of(robot, *obstacles):
    """Return a robot without a floor, among obstacles."""
    floor = Floor(None, np.array([0.0, 0.0, 1.0]), 'given')
    return CollisionScene(collision_model(robot), floor, obstacles, 0.01)


@pytest.fixture(scope='module')
def plan(case, planned):
    return ExcitationResult(planned, case.truth, scene_of(case.truth.robot, TABLE))


@pytest.fixture(scope='module')
def html(plan):
    return plan.page()


def charts(html):
    """Return the data of all charts."""
    found = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    return [json.loads(text) for text in found]


def test_every_joint_is_shown_against_its_limits(case, planned, html):
    shown = charts(html)
    n = case.truth.robot.n_joints
    for j in range(n):
        position, velocity, acceleration, torque = shown[4 * j : 4 * j + 4]
        limits = planned.limits
        np.testing.assert_allclose(
            [level['y'] for level in position['levels']], [limits.lower[j], limits.upper[j]]
        )
        for chart, limit in (
            (velocity, limits.velocity),
            (acceleration, limits.acceleration),
            (torque, limits.torque),
        ):
            assert [level['y'] for level in chart['levels']] == [-limit[j], limit[j]]
            assert np.abs(chart['series'][0]['y']).max() <= limit[j] * (1.0 + 1e-4)


def test_clearance_is_that_of_links_and_that_of_the_environment(case, plan, html):
    chart = charts(html)[-1]
    own, around = (np.array(series['y']) / 100.0 for series in chart['series'])
    robot = case.truth.robot
    q = plan.run.at(np.linspace(0.0, plan.run.duration, 600)).q
    np.testing.assert_allclose(own, path_clearance(collision_model(robot), q), atol=1e-4)
    assert around.min() > 0.0


def test_every_parameter_is_listed_with_its_deviation(planned, html):
    for name in planned.information.parameters:
        assert name.name in html or name.joint in html
    assert PARTLY in html
    assert 'table &lt;b&gt;' in html and '<b>' not in html


def test_what_the_run_does_not_show_comes_first(case, planned):
    matrix = planned.information.matrix.copy()
    matrix[0], matrix[:, 0] = 0.0, 0.0
    blind = replace(planned, information=replace(planned.information, matrix=matrix))
    page = ExcitationResult(blind, case.truth, scene_of(case.truth.robot)).page()
    assert '>not identifiable<' in page


def test_an_arm_without_bodies_is_drawn_though_its_links_are_points_for_the_floor():
    """A link without a body is held against the floor by the place of its joint."""
    robot = load_robot(Path(__file__).parents[2] / 'examples' / 'arm.urdf')
    collision = collision_model(robot)
    floor = Floor(0.0, np.array([0.0, 0.0, 1.0]), 'given')
    whole = with_obstacles(collision, floor_obstacles(collision, floor, 0.01))
    poses = np.zeros((1, robot.n_joints))
    (drawn,) = draw_poses(whole, poses, poses)
    assert sum(colour != OBSTACLE for _, colour in drawn.bodies) == robot.n_joints + 1
