# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A learned torque is what its maps say near their points, and nothing far from them."""

from armid_ros.arm import ArmModel, load_model, save_model
from armid_ros.arm.testing import CHECKS, EffectCase, sines
from armid_ros.effects.learned import holding_torque, LearnedTorque, TorqueMap
from armid_ros.errors import ModelError
from armid_ros.model import inverse_dynamics
import numpy as np
import pytest
import yaml

JOINTS = 'shoulder_roll', 'elbow_pitch'


def posterior(rng, load=2.0, torque=lambda x: 0.3 * x[:, 0] + 0.1 * np.sign(x[:, 1])):
    """Return a map of forty points."""
    points = rng.uniform([-1.0, -2.0, -3.0], [1.0, 2.0, 3.0], (40, 3))
    lengths = np.array([0.5, 0.6, load])
    empty = TorqueMap(points, np.zeros(40), np.full(40, 0.02), lengths, 0.4, 0.3)
    return empty.fitted_to(torque(points))


@pytest.fixture
def learned():
    rng = np.random.default_rng(0)
    return LearnedTorque(JOINTS, maps=(posterior(rng), posterior(rng, np.inf)))


def test_a_map_is_its_data_where_it_has_some_and_zero_far_away(learned):
    own = learned.maps[0]
    wanted = 0.3 * own.points[:, 0] + 0.1 * np.sign(own.points[:, 1])
    assert np.sqrt(np.mean((own.torque(own.points) - wanted) ** 2)) < 0.02
    assert np.all(own.std(own.points) < 0.03)
    far = own.points + np.array([30.0, 0.0, 0.0])
    np.testing.assert_allclose(own.torque(far), 0.0, atol=1e-12)
    np.testing.assert_allclose(own.std(far), own.amplitude, rtol=1e-9)


def test_its_deviation_holds_the_truth():
    """Draws of the prior are within two deviations of what their noisy samples predict."""
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(40):
        points = rng.uniform(-1.0, 1.0, (30, 3))
        own = TorqueMap(points, np.zeros(30), np.full(30, 0.1), np.full(3, 0.7), 1.0, 100.0)
        every = np.concatenate([points, rng.uniform(-1.5, 1.5, (5, 3))])
        difference = (every[:, None] - every) / 0.7
        kernel = np.exp(-0.5 * np.sum(difference**2, axis=-1)) + 1e-10 * np.eye(35)
        drawn = np.linalg.cholesky(kernel) @ rng.normal(size=35)
        found = own.fitted_to(drawn[:30] + 0.1 * rng.normal(size=30))
        inside += list(
            np.abs(found.torque(every[30:]) - drawn[30:]) < 1.96 * found.std(every[30:])
        )
    assert 0.9 < np.mean(inside) < 0.99


@pytest.mark.parametrize('check', CHECKS, ids=lambda check: check.__name__)
def test_with_maps_it_keeps_the_contract(robot, learned, check):
    motion = sines(robot).with_torque(np.zeros_like(sines(robot).q))
    check(EffectCase(learned, robot, motion, np.array([0.8, -1.1])))


def test_the_load_is_what_holds_the_arm_where_it_is(robot):
    motion = sines(robot)
    held = inverse_dynamics(robot, motion.at_rest())
    np.testing.assert_allclose(holding_torque(robot, motion.q), held, atol=1e-12)
    np.testing.assert_allclose(holding_torque(robot, motion.q[3]), held[3], atol=1e-12)


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        (lambda m: m['points'].__setitem__(0, '0 0 x 0 1'), "'shoulder_roll'"),
        (lambda m: m['points'].__setitem__(0, '0.1 0.2'), "'shoulder_roll'"),
        (lambda m: m['points'].__setitem__(0, '0 0 0 nan 1'), 'finite'),
        (lambda m: m.__setitem__('amplitude', -1.0), 'positive'),
        (lambda m: m.__setitem__('joint', 'wrist'), "map of joint 'shoulder_roll'"),
    ],
)
def test_a_file_keeps_the_maps_and_a_damaged_one_is_refused_with_the_joint(
    robot, learned, tmp_path, change, said
):
    path, arm = tmp_path / 'model.yaml', ArmModel(robot).with_effect(learned, [1.0, 1.0])
    save_model(path, arm, 'humanoid_arm')
    again, motion = load_model(path), sines(robot)
    np.testing.assert_allclose(again.torque(motion), arm.torque(motion), atol=1e-7)
    assert again.effects[0].maps[1].lengths[2] == np.inf
    document = yaml.safe_load(path.read_text())
    change(document['effects'][0]['maps'][0])
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(ModelError, match=said):
        load_model(path)
