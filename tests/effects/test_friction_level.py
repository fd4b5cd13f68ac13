# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction of all joints by one factor is viscous and Coulomb friction of each, in one value."""

from armid_ros.arm import ArmModel
from armid_ros.effects import CATALOGUE, merge_actions, parse_effect
from armid_ros.effects.friction import friction_level
import numpy as np
import pytest


@pytest.fixture(scope='module')
def arm(robot):
    """Return an arm of which four joints have friction, one of them viscous friction alone."""
    first, second, third, fourth = robot.joints[:4]
    arm = ArmModel(robot)
    for text in (
        f'viscous_friction@{first}+{third}:viscous_coefficient=0.4',
        f'viscous_friction@{second}:viscous_coefficient=0.1',
        f'coulomb_friction@{first}+{second}+{fourth}:coulomb_torque=0.7',
    ):
        arm = arm.with_effect(*parse_effect(text, robot))
    return arm


@pytest.fixture(scope='module')
def level(arm, robot):
    kind, _ = friction_level(zip(arm.effects, arm.values, strict=True), robot, CATALOGUE)
    return kind.on(robot)


def test_its_column_is_the_friction_that_there_was(arm, level, motion, robot):
    friction = arm.torque(motion) - ArmModel(robot).torque(motion)
    assert level.joints == robot.joints[:4]
    np.testing.assert_allclose(level.columns(motion, arm)[:, :, 0], friction, atol=1e-12)


def test_viscous_friction_alone_may_have_the_factor(arm, motion, robot):
    """What the lubricant does in the cold: Coulomb friction hardly depends on temperature."""
    _, kind = friction_level(zip(arm.effects, arm.values, strict=True), robot, CATALOGUE)
    viscous = kind.on(robot)
    assert viscous.joints == robot.joints[:3] and viscous.said_as == 'viscous_friction'
    torque = viscous.columns(motion, arm)[:, :, 0]
    np.testing.assert_allclose(torque[:, :3], [0.4, 0.1, 0.4] * motion.dq[:, :3], atol=1e-12)
    assert not torque[:, 3:].any()
    ((said, values),) = viscous.named_as(np.array([0.5]), arm)
    assert said.name == 'viscous_friction'
    np.testing.assert_allclose(values, [0.2, 0.05, 0.2])


def test_it_acts_as_it_is_said(arm, level, motion, robot):
    k = np.array([-0.3])
    said = level.named_as(k, arm)
    assert [effect.name for effect, _ in said] == ['viscous_friction', 'coulomb_friction']
    assert all(effect.name in CATALOGUE for effect, _ in said)
    together = sum(effect.columns(motion, arm) @ values for effect, values in said)
    np.testing.assert_allclose(together, level.columns(motion, arm) @ k, atol=1e-12)
    bare = ArmModel(robot)
    own = level.action(k, bare)
    parts = merge_actions(robot, [effect.action(values, bare) for effect, values in said])
    np.testing.assert_allclose(own.damping, parts.damping)
    load = np.zeros(robot.n_joints)
    np.testing.assert_allclose(own.dry_friction.largest(load), parts.dry_friction.largest(load))


def test_each_joint_has_its_own_factor_once_it_is_found(arm, level, motion, robot):
    found, first = level.when_found(np.array([-0.3]))
    assert [p.joint for p in found.parameters(robot)] == list(level.joints)
    columns = found.columns(motion, arm)
    np.testing.assert_allclose(columns @ first, level.columns(motion, arm) @ [-0.3], atol=1e-12)
    k = np.array([-0.4, 0.1, 0.2, -0.1])
    together = sum(e.columns(motion, arm) @ values for e, values in found.named_as(k, arm))
    np.testing.assert_allclose(together, columns @ k, atol=1e-12)
    bare = ArmModel(robot)
    parts = merge_actions(robot, [e.action(values, bare) for e, values in found.named_as(k, arm)])
    np.testing.assert_allclose(found.action(k, bare).damping, parts.damping)


@pytest.mark.parametrize(
    ('effects', 'named', 'factors'),
    [
        (slice(0), CATALOGUE, 0),
        (slice(1, 2), CATALOGUE, 0),
        (slice(2), CATALOGUE, 1),
        (slice(3), ['viscous_friction'], 0),
        (slice(3), CATALOGUE, 2),
    ],
    ids=['none', 'one joint', 'no Coulomb', 'may not be named', 'both'],
)
def test_there_are_as_many_factors_as_kinds_of_friction(arm, robot, effects, named, factors):
    pairs = list(zip(arm.effects, arm.values, strict=True))[effects]
    assert len(friction_level(pairs, robot, named)) == factors
