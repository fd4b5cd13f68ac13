# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Courses for elastic joints keep the limits, stand between experiments, and excite the band."""

from armid_ros.errors import TrajectoryError
from armid_ros.robots import load_robot
from armid_ros.simulation.elastic import multisine_course, step_course
import numpy as np
import pytest

STEP = 0.125


@pytest.fixture(scope='module')
def robot():
    return load_robot('two_link_elastic')


def anywhere(way):
    return True


def stretches(moving):
    """Return first and last sample of every stretch of motion."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], moving.astype(int), [0]])))
    return edges.reshape(-1, 2)


def test_multisines_are_on_top_of_moves_only_and_fill_the_band(robot):
    course = multisine_course(robot, 22.0, 0.1, np.random.default_rng(1), anywhere)
    assert course.duration <= 22.0
    assert np.all(course.tau[np.all(course.dq == 0.0, axis=1)] == 0.0)
    moves = stretches(np.any(course.dq != 0.0, axis=1))
    assert len(moves) == 4
    for first, last in moves:
        assert last - first > 0.5 * 500
        tau = course.tau[first:last]
        np.testing.assert_allclose(tau.std(axis=0), 0.1 * robot.torque_limit, rtol=0.1)
        power = np.abs(np.fft.rfft(tau, axis=0)) ** 2
        frequency = np.fft.rfftfreq(len(tau), 1.0 / 500.0)
        inside = (frequency >= 1.5) & (frequency <= 100.5)
        assert power[inside].sum() > 0.98 * power.sum()
        for low in range(5, 95, 10):
            near = (frequency >= low) & (frequency < low + 10)
            assert power[near].sum() > 0.05 * power.sum()
    assert np.all(np.abs(course.dq) <= robot.velocity_limit)


def test_steps_begin_at_rest_and_are_of_each_joint_and_of_all(robot):
    course = step_course(robot, 60.0, STEP, np.random.default_rng(1), anywhere)
    motion = course.sample(np.arange(0.0, course.duration, 1e-3))
    moves = stretches(np.any(motion.dq != 0.0, axis=1))
    speed = STEP * robot.velocity_limit
    steps = [
        np.sign(np.round(motion.dq[first + 5] / speed, 6))
        for first, last in moves
        if abs(last - first - 500) <= 2 and np.allclose(motion.dq[first + 5] % speed, 0.0)
    ]
    for wanted in ([1, 0], [0, 1], [1, 1], [1, -1]):
        assert any(np.array_equal(step, wanted) for step in steps)
    rests = moves[1:, 0] - moves[:-1, 1]
    assert rests.min() >= 990


def test_ways_that_are_not_clear_are_not_taken(robot):
    def clear(way):
        return bool(np.all(way[:, 0] >= -0.1))

    course = multisine_course(robot, 40.0, 0.1, np.random.default_rng(2), clear)
    assert course.q[:, 0].min() >= -0.11
    with pytest.raises(TrajectoryError, match='1000'):
        step_course(robot, 40.0, STEP, np.random.default_rng(2), lambda way: False)


def test_too_short_a_course_is_refused(robot):
    with pytest.raises(TrajectoryError, match=' 6 s'):
        multisine_course(robot, 5.0, 0.1, np.random.default_rng(1), anywhere)
