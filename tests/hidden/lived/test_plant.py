# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a cause does to the effort is what its parameters say, and nothing else."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tests.hidden.lived.arms import load_arm
from tests.hidden.lived.causes import (
    Coulomb,
    Delay,
    Encoder,
    Gain,
    Holding,
    LoadFriction,
    Mounting,
    Offset,
    Payload,
    Pulling,
    Rotor,
    Spring,
    Stribeck,
    Tilt,
    Viscous,
)
from tests.hidden.lived.chain import Chain
from tests.hidden.lived.motions import draw_path, Path, tracked
from tests.hidden.lived.plant import LivedArm
from tests.hidden.lived.test_chain import compile_arm, inverse
from tests.hidden.lived.wear import bristle, low_pass, Wear

ROBOT = load_arm('ur5')
CHAIN = Chain.of(ROBOT)
BARE = LivedArm(CHAIN, replace(Wear.none(6), presliding=np.full(6, 1e-6)))
JOINT, K = ROBOT.joints[2], 2


@pytest.fixture(scope='module')
def path():
    """Return a motion as the arm follows it."""
    wanted = draw_path('wandering', ROBOT, CHAIN, 6.0, np.random.default_rng(3))
    return tracked(wanted, CHAIN, np.full(6, 1e-3))


def only(values):
    """Return values of one joint as those of all."""
    columns = np.zeros((len(values), 6))
    columns[:, K] = values
    return columns


def test_a_bare_arm_reports_its_inverse_dynamics(path):
    rows = slice(None, None, 500)
    states = [x[rows] for x in (path.q, path.dq, path.ddq)]
    expected = inverse(compile_arm(ROBOT), ROBOT, states)
    np.testing.assert_allclose(BARE.effort(path)[rows], expected, atol=1e-8)


def test_a_payload_adds_what_mujoco_says(path):
    ball = Payload(ROBOT.joints[-1], 5, 2.0, (0.03, -0.05, 0.1), 0.05)
    rows = slice(None, None, 500)
    states = [x[rows] for x in (path.q, path.dq, path.ddq)]
    more = inverse(compile_arm(ROBOT, payload=ball), ROBOT, states)
    expected = more - inverse(compile_arm(ROBOT), ROBOT, states)
    np.testing.assert_allclose(BARE.contribution(path, ball)[rows], expected, atol=1e-8)


def test_a_tilted_base_sees_gravity_turned_back(path):
    tilt = Tilt((0.0, np.pi / 2))  # turned about y, the base sees down along its own x
    np.testing.assert_allclose(tilt.bodies(CHAIN).gravity, [9.81, 0.0, 0.0], atol=1e-9)
    wall = Mounting((9.81, 0.0, 0.0))
    np.testing.assert_allclose(BARE.effort(path, tilt), BARE.effort(path, wall), atol=1e-8)


def test_a_person_who_holds_pushes_as_a_force_of_mujoco_does(path):
    grip = Holding(JOINT, K, 80.0, (0.1, 0.02, 0.3), (0.4, 0.1, 0.5), (0.0, 0.0, 0.0))
    added = grip.torque(path, CHAIN)
    model = compile_arm(ROBOT)
    data = mujoco.MjData(model)
    dofs = [int(model.joint(joint).qposadr[0]) for joint in ROBOT.joints]
    body = int(model.joint(JOINT).bodyid[0])
    for k in (100, 2500, 5000):
        data.qpos[dofs], data.qvel[dofs] = path.q[k], path.dq[k]
        mujoco.mj_forward(model, data)
        place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array(grip.attachment)
        jacobian = np.empty((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, place, body)
        velocity = jacobian @ data.qvel
        force = 80.0 * (np.array(grip.anchor) - place) - 80.0 * grip.damping_time * velocity
        torque = np.zeros(model.nv)
        mujoco.mj_applyFT(model, data, force, np.zeros(3), place, body, torque)
        np.testing.assert_allclose(added[k], -torque[dofs], atol=1e-9)


def test_what_pulls_down_with_its_weight_is_a_point_mass_at_rest():
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 6))
    still = Path(np.arange(20) * 1e-3, q, np.zeros_like(q), np.zeros_like(q))
    point = (0.05, 0.0, 0.1)
    rope = Pulling(ROBOT.joints[-1], 5, 3.0 * 9.81, point, (0.0, 0.0, -1.0))
    ball = Payload(ROBOT.joints[-1], 5, 3.0, point, 1e-6)
    expected = ball.bodies(CHAIN).torque(q, still.dq, still.ddq) - CHAIN.torque(
        q, still.dq, still.ddq
    )
    np.testing.assert_allclose(rope.torque(still, CHAIN), expected, atol=1e-9)


@pytest.mark.parametrize(
    ('cause', 'law'),
    [
        (Viscous(JOINT, K, 2.0), lambda p: 2.0 * p.dq[:, K]),
        (Rotor(JOINT, K, 0.3), lambda p: 0.3 * p.ddq[:, K]),
        (Spring(JOINT, K, 5.0, 0.4), lambda p: 5.0 * (p.q[:, K] - 0.4)),
        (Offset(JOINT, K, -0.7), lambda p: np.full(len(p.t), -0.7)),
        (Gain(JOINT, K, 0.1), lambda p: 0.1 * BARE.effort(p)[:, K]),
    ],
)
def test_contributions_are_the_textbook_laws(path, cause, law):
    np.testing.assert_allclose(BARE.contribution(path, cause), only(law(path)), atol=1e-9)


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


def test_an_encoder_that_reads_too_little_is_the_arm_elsewhere(path):
    cause = Encoder(JOINT, K, 0.04)
    there = path.q.copy()
    there[:, K] += 0.04
    expected = BARE.effort(replace(path, q=there))
    np.testing.assert_allclose(BARE.effort(path, cause), expected, atol=1e-9)


def test_a_delay_shifts_all_that_is_reported(path):
    late = BARE.effort(path, Delay(0.012))
    np.testing.assert_allclose(late[12:], BARE.effort(path)[:-12], atol=1e-9)


def test_the_low_pass_lags_a_ramp_by_its_time_constant():
    t = np.arange(2000) * 1e-3
    lagged = low_pass(3.0 * t[:, np.newaxis], 0.004, 1e-3)
    np.testing.assert_allclose(lagged[200:, 0], 3.0 * (t[200:] - 0.004), atol=1e-9)
