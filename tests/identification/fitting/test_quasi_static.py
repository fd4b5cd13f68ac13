# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The weight of an arm that moves slowly, which is never slow enough for inertia not to count."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.identification import identify, Score
import numpy as np
import pytest

from ..conftest import multisine, recorded


@pytest.fixture(scope='module', params=[9.81, 1.62], ids=['earth', 'moon'])
def slow(arm, request):
    """Return an arm and a slow motion of it."""
    robot = arm.robot.with_gravity(np.array([0.0, 0.0, -request.param]))
    motion = multisine(robot.joints, 40.0, 100.0, seed=3, amplitude=0.7, base_hz=0.05)
    return replace(arm, robot=robot), motion


def weighed(truth, description, motion, noise=0.0):
    structure = ArmModel(description, truth.effects, quasi_static=True)
    recording = recorded(truth, motion, 1, noise)
    return recording, identify(structure, [recording], rng=np.random.default_rng(0))


def inside(result, truth):
    """Count composites within 95 %, and all of them."""
    rigid = [k for k, name in enumerate(result.estimate.parameters) if name.rigid]
    off = (result.estimate.values - result.base.values(truth.theta)) / result.estimate.std
    return int(np.sum(np.abs(off[rigid]) < 1.96)), len(rigid)


@pytest.mark.parametrize('seed', [None, 0, 1])
def test_composites_are_inside_their_intervals_whatever_the_described_inertia(slow, seed):
    """Second moments are as described, or off by up to 40 %, masses by 10 %."""
    truth, motion = slow
    bodies = truth.robot.rigid_parameters.reshape(-1, 10).copy()
    if seed is not None:
        rng = np.random.default_rng(seed)
        bodies[:, 4:] *= rng.uniform(0.6, 1.4, (6, 1))
        bodies *= rng.uniform(0.9, 1.1, (6, 1))
    recording, result = weighed(truth, truth.robot.with_inertias(bodies.ravel()), motion)
    assert inside(result, truth) == (12, 12)
    assert any('too fast' in note for note in result.notes)
    if seed is None:
        for fits in (result.training, result.predict([recording])):
            assert Score.of(fits).relative_error_percent < 0.01


def test_a_motion_that_is_slow_enough_says_nothing(arm):
    motion = multisine(arm.robot.joints, 500.0, 4.0, seed=3, amplitude=0.7, base_hz=0.002)
    _, result = weighed(arm, arm.robot, motion, noise=0.02)
    assert not any('too fast' in note for note in result.notes)
    found, count = inside(result, arm)
    assert found >= count - 3
