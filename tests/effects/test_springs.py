# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Springs of all kinds: on a joint, between joints, at the ends of the range, to the world."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.effects.tied import TiedInteraction
from armid_ros.model import LinkFrames
from armid_ros.motion import Motion, MovingPoints
from armid_ros.robots.ties import Tie
import numpy as np
import pytest


def closed_loop_path(robot, points=4000):
    """Go round a closed curve in joint space, slowly."""
    phase = np.linspace(0.0, 2.0 * np.pi, points)[:, None]
    middle, span = (robot.lower + robot.upper) / 2, robot.upper - robot.lower
    q = middle + 0.45 * span * np.sin(phase * np.array([1, 2, 1, 3, 2, 1]) + np.arange(6))
    zero = np.zeros_like(q)
    return Motion(robot.joints, phase[:, 0], q, zero, zero)


def work(torque, q):
    """Integrate the power along a path, shape (N - 1,)."""
    return np.sum((torque[1:] + torque[:-1]) / 2 * np.diff(q, axis=0), axis=1)


@pytest.mark.parametrize(
    ('name', 'values'),
    [
        ('joint_spring', [3.0, 0.5]),
        ('joint_coupling', 2.0),
        ('soft_limit', 30.0),
        ('human_interaction', [300.0, 0.0, 5.0, -2.0, 3.0]),
        ('interface_slack', 300.0),
        ('torque_ripple', [0.1, 0.2]),
    ],
)
def test_springs_give_back_what_they_take(robot, added, name, values):
    path = closed_loop_path(robot)
    power = work(added(path, name, values), path.q)
    assert np.abs(power).sum() > 0.1
    assert abs(power.sum()) < 1e-4 * np.abs(power).sum()


def pull(robot, joint, offset, motion, anchor, stiffness):
    """Return the torque against a spring, from its energy by differences."""
    torque = np.empty_like(motion.q)
    for j, step in enumerate(1e-6 * np.eye(6)):
        ends = [
            stiffness
            / 2
            * np.sum((LinkFrames.of(robot, q).places(joint, offset) - anchor) ** 2, axis=1)
            for q in (motion.q + step, motion.q - step)
        ]
        torque[:, j] = (ends[0] - ends[1]) / 2e-6
    return torque


def fixed_at(robot, effect, anchor, stiffness):
    """Return the values of a spring from the elbow to a fixed point."""
    middle = LinkFrames.in_the_middle(robot).places('elbow_pitch', effect.shape_values[0])[0]
    return [stiffness, 0.0, *stiffness * (anchor - middle)]


def test_a_spring_to_the_world_is_the_gradient_of_its_energy(robot, motion):
    effect = make_effect('human_interaction@elbow_pitch', robot).with_shape([0.05, 0.0, 0.1])
    anchor = np.array([0.3, 0.2, 0.4])
    arm = ArmModel(robot).with_effect(effect, fixed_at(robot, effect, anchor, 400.0))
    torque = arm.torque(motion) - ArmModel(robot).torque(motion)
    expected = pull(robot, 'elbow_pitch', np.array([0.05, 0.0, 0.1]), motion, anchor, 400.0)
    np.testing.assert_allclose(torque, expected, atol=1e-5)
    assert not np.any(torque[:, 4:])


@pytest.mark.parametrize('name', ['human_interaction', 'interface_slack'])
def test_a_person_holds_the_arm_where_it_is_though_a_fit_has_no_mass_there(robot, name):
    """First moments without mass put a centre kilometres away."""
    theta = robot.rigid_parameters.copy()
    theta[50:53] = 1e-6, 0.3, -0.2
    light = make_effect(name, robot.with_inertias(theta))
    attached = light.shape_values[-1, :3]
    assert 0.1 < np.linalg.norm(attached) < 1.0
    np.testing.assert_allclose(attached[1] / attached[0], -0.2 / 0.3)
    others = make_effect(name, robot).shape_values[:-1, :3]
    np.testing.assert_allclose(light.shape_values[:-1, :3], others)


def test_without_slack_an_interface_is_a_spring(robot, motion):
    anchor = np.array([0.3, 0.2, 0.4])
    spring = make_effect('human_interaction@elbow_pitch', robot).with_shape([0.05, 0.0, 0.1])
    strap = make_effect('interface_slack@elbow_pitch', robot)
    strap = strap.with_shape([0.05, 0.0, 0.1, *anchor, 0.0])
    arms = (
        ArmModel(robot).with_effect(spring, fixed_at(robot, spring, anchor, 400.0)),
        ArmModel(robot).with_effect(strap, [400.0]),
    )
    np.testing.assert_allclose(arms[0].torque(motion), arms[1].torque(motion), atol=1e-9)


def test_two_chains_that_move_alike_do_not_pull_each_other(robot, motion):
    """A point of a second arm, recorded; then the same arm a little behind."""
    elbow, offset = 'elbow_pitch', (0.05, 0.0, 0.1)
    effect = TiedInteraction((elbow,), ties=(Tie('point', elbow, elbow, offset, offset),))
    places, jacobian = LinkFrames.of(robot, motion.q).points([elbow], np.array([offset]))
    velocity = np.einsum('nkxj,nj->nkx', jacobian, motion.dq)
    beside = replace(motion, partner=MovingPoints(('point',), places, velocity))
    arm = ArmModel(robot).with_effect(effect, [400.0, 10.0])
    np.testing.assert_allclose(arm.torque(beside), ArmModel(robot).torque(motion), atol=1e-9)

    late = LinkFrames.of(robot, motion.q - 0.01).places(elbow, np.array(offset))[:, np.newaxis]
    behind = replace(motion, partner=MovingPoints(('point',), late, velocity))
    arm = ArmModel(robot).with_effect(effect, [400.0, 0.0])
    expected = 400.0 * np.einsum('nkxj,nkx->nj', jacobian, places - late)
    np.testing.assert_allclose(
        arm.torque(behind) - ArmModel(robot).torque(motion), expected, atol=1e-9
    )


def test_a_spring_pulls_back_and_a_ripple_is_faster_than_gravity(robot):
    """What pushes away, or repeats once a turn, is a mass that is other than described."""
    arm, sure = ArmModel(robot), np.array([0.1, 0.1])
    spring = make_effect('joint_spring@elbow_pitch', robot)
    assert spring.bounds()[0].tolist() == [0.0, -np.inf]
    ripple = make_effect('torque_ripple@elbow_pitch', robot)
    slowest = ripple.shapes[0].lower
    assert ripple.with_shape(8.0).plausible(np.ones(2), sure, arm)
    assert not ripple.with_shape(slowest).plausible(np.ones(2), sure, arm)
