# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Inverse dynamics of the generator is that of MuJoCo, and linear in the bodies."""

import mujoco
import numpy as np
import pytest

from tests.hidden.descriptions import bare_urdf
from tests.hidden.lived.arms import ARMS, load_arm
from tests.hidden.lived.causes.rigid import Payload
from tests.hidden.lived.chain import Chain

NAMES = sorted({name for names in ARMS.values() for name in names})


def draw_states(n, count=7, seed=1):
    """Draw positions, velocities and accelerations, each (count, n)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.5, 1.5, (count, n)), *(3.0 * rng.normal(size=(2, count, n)))


def compile_arm(robot, *, payload=None, gravity=None):
    """Compile a robot by MuJoCo alone, with a ball in its hand."""
    spec = mujoco.MjSpec.from_string(bare_urdf(robot))
    spec.compiler.fusestatic, spec.compiler.balanceinertia = True, False
    spec.option.gravity = robot.gravity if gravity is None else gravity
    if payload is not None:
        body = spec.joint(payload.joint).parent.add_body(name='payload', ipos=payload.centre)
        body.mass, body.explicitinertial = payload.value, True
        body.inertia = np.full(3, 0.4 * payload.value * payload.radius**2)
    return spec.compile()


def inverse(model, robot, states):
    """Return the torque of MuJoCo's inverse dynamics, (count, n)."""
    data = mujoco.MjData(model)
    dofs = [int(model.joint(joint).qposadr[0]) for joint in robot.joints]
    tau = []
    for q, dq, ddq in zip(*states, strict=True):
        data.qpos[dofs], data.qvel[dofs], data.qacc[dofs] = q, dq, ddq
        mujoco.mj_inverse(model, data)
        tau.append(data.qfrc_inverse[dofs])
    return np.array(tau)


@pytest.mark.parametrize('name', NAMES)
def test_torque_is_that_of_mujoco(name):
    robot = load_arm(name)
    states = draw_states(robot.n_joints)
    tau = Chain.of(robot).torque(*states)
    expected = inverse(compile_arm(robot), robot, states)
    np.testing.assert_allclose(tau, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize('name', ['panda', 'drawn-5-0'])
def test_torque_of_a_payload_on_a_wall_is_that_of_mujoco(name):
    robot = load_arm(name)
    joint, last = robot.joints[-1], robot.n_joints - 1
    ball = Payload(joint, last, 1.7, (0.05, -0.08, 0.11), 0.04)
    gravity = np.array([9.81, 0.0, 0.0])
    states = draw_states(robot.n_joints, seed=2)
    with_ball = ball.bodies(Chain.of(robot).with_gravity(gravity))
    tau = with_ball.torque(*states)
    expected = inverse(compile_arm(robot, payload=ball, gravity=gravity), robot, states)
    np.testing.assert_allclose(tau, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


def test_columns_times_bodies_are_the_torque():
    chain = Chain.of(load_arm('drawn-4-0'))
    states = draw_states(4)
    tau = chain.columns(*states) @ chain.bodies.ravel()
    np.testing.assert_allclose(tau, chain.torque(*states), rtol=1e-10, atol=1e-10)


def test_point_and_its_jacobian_are_those_of_mujoco():
    robot = load_arm('ur5')
    model = compile_arm(robot)
    data = mujoco.MjData(model)
    dofs = [int(model.joint(joint).qposadr[0]) for joint in robot.joints]
    q = draw_states(6)[0]
    offset = np.array([0.02, -0.05, 0.1])
    places, jacobians = Chain.of(robot).point(4, offset, q)
    body = int(model.joint(robot.joints[4]).bodyid[0])
    for k, posture in enumerate(q):
        data.qpos[dofs] = posture
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
        jacobian = np.empty((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, place, body)
        np.testing.assert_allclose(places[:, k], place, atol=1e-9)
        np.testing.assert_allclose(jacobians[:, :, k].T, jacobian[:, dofs], atol=1e-9)
