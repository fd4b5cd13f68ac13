# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a cause does to the effort is what its parameters say, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hidden.arrays import low_pass
from tests.hidden.lived.arms import load_arm
from tests.hidden.lived.causes.drive import Coulomb, LoadFriction, Stribeck
from tests.hidden.lived.causes.rigid import Mounting, Tilt
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import draw_path, tracked
from tests.hidden.lived.plant import LivedArm
from tests.hidden.lived.wear import bristle, Wear

ROBOT = load_arm('ur5')
CHAIN = Chain.of(ROBOT)
BARE = LivedArm(CHAIN, replace(Wear.none(6), presliding=np.full(6, 1e-6)))
JOINT, K = ROBOT.joints[2], 2


@pytest.fixture(scope='module')
def path():
    """Return a motion as the arm follows it."""
    wanted = draw_path('wandering', ROBOT, CHAIN, 6.0, np.random.default_rng(3))
    return tracked(wanted, CHAIN, np.full(6, 1e-3))


def test_a_tilted_base_sees_gravity_turned_back(path):
    tilt = Tilt((0.0, np.pi / 2))  # turned about y, the base sees down along its own x
    np.testing.assert_allclose(tilt.bodies(CHAIN).gravity, [9.81, 0.0, 0.0], atol=1e-9)
    wall = Mounting((9.81, 0.0, 0.0))
    np.testing.assert_allclose(BARE.effort(path, tilt), BARE.effort(path, wall), atol=1e-8)


def test_dry_friction_opposes_motion_and_holds_at_rest(path):
    moving = np.abs(path.dq[:, K]) > 0.05
    sign = np.sign(path.dq[moving, K])
    for cause, size in (
        (Coulomb(JOINT, K, 1.5), np.full(len(path.t), 1.5)),
        (Stribeck(JOINT, K, 1.5, 0.2), 1.5 * np.exp(-((path.dq[:, K] / 0.2) ** 2))),
        (LoadFriction(JOINT, K, 0.1), 0.1 * np.abs(BARE.effort(path)[:, K])),
    ):
        added = BARE.contribution(path, cause)
        assert np.all(np.abs(added[:, K]) <= size + 1e-9)
        np.testing.assert_allclose(added[moving, K], size[moving] * sign, atol=1e-3)
        added[:, K] = 0.0
        np.testing.assert_allclose(added, 0.0, atol=1e-9)


def test_the_bristle_is_dahl_between_any_samples():
    rng = np.random.default_rng(4)
    q = np.cumsum(rng.normal(size=(400, 1)), axis=0) * 1e-3
    q[100:150] = q[100]
    state, distance = 0.0, 2e-3
    for k, way in enumerate(np.diff(q[:, 0])):
        target = np.sign(way)
        if way:
            state = target + (state - target) * np.exp(-abs(way) / distance)
        assert bristle(q, np.array([distance]))[k + 1, 0] == pytest.approx(state, abs=1e-12)


def test_the_low_pass_lags_a_ramp_by_its_time_constant():
    t = np.arange(2000) * 1e-3
    lagged = low_pass(3.0 * t[:, np.newaxis], 0.004, 1e-3)
    np.testing.assert_allclose(lagged[200:, 0], 3.0 * (t[200:] - 0.004), atol=1e-9)
