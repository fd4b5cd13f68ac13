# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The arms in MuJoCo are those that Pinocchio knows, and they follow their references badly."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from tests.hidden.load import ActuatorSaturation
from tests.hidden.machines import load_machine, MACHINES, position_range, with_rigid_errors
from tests.hidden.plant import Plant, run
from tests.hidden.trajectories import draw_orbit, reference, SPEEDS


@pytest.mark.parametrize('machine', MACHINES)
def test_inverse_dynamics_of_both_engines_agree(machine):
    robot = load_machine(machine)
    live = Plant(robot, {}).build()
    rng = np.random.default_rng(0)
    data = robot.model.createData()
    for _ in range(20):
        q = rng.uniform(*position_range(robot))
        dq, ddq = rng.normal(size=(2, robot.n_joints))
        live.data.qpos[live.dofs], live.data.qvel[live.dofs] = q, dq
        live.data.qacc[live.dofs] = ddq
        mujoco.mj_inverse(live.model, live.data)
        tau = pin.rnea(robot.model, data, q, dq, ddq)
        np.testing.assert_allclose(live.data.qfrc_inverse[live.dofs], tau, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize('speed', SPEEDS)
def test_references_keep_the_limits_and_repeat(speed):
    robot = load_machine('panda')
    rng = np.random.default_rng(1)
    wanted = reference(draw_orbit(robot, speed, rng), 1e-3)
    assert np.all((wanted.q > robot.lower) & (wanted.q < robot.upper))
    assert np.all(np.abs(wanted.dq) < 1.01 * SPEEDS[speed].share * robot.velocity_limit)
    assert not wanted.dq[[0, -1]].any()
    np.testing.assert_allclose(np.gradient(wanted.q, 1e-3, axis=0), wanted.dq, atol=1e-4)
    np.testing.assert_allclose(np.gradient(wanted.dq, 1e-3, axis=0), wanted.ddq, atol=1e-3)
    first, second = (round(start / 1e-3) for start in wanted.starts)
    period = round(wanted.period / 1e-3)
    np.testing.assert_allclose(
        wanted.q[first : first + period], wanted.q[second : second + period], atol=1e-9
    )


def test_arm_follows_but_not_exactly():
    robot = load_machine('ur10')
    rng = np.random.default_rng(2)
    wanted = reference(draw_orbit(robot, 'fast', rng), 1e-3)
    error = np.abs(run(Plant(robot, {'rotor_inertia': np.full(6, 0.1)}), wanted, rng).q - wanted.q)
    assert 1e-4 < error.max() < 0.1


def test_an_arm_that_falls_is_not_recorded():
    robot = load_machine('ur10')
    rng = np.random.default_rng(3)
    wanted = reference(draw_orbit(robot, 'slow', rng), 1e-3)
    weak = [
        ActuatorSaturation(joint, j, 0.1, 1.1) for j, joint in enumerate(robot.joints)
    ]  # 1 N m
    with pytest.raises(FloatingPointError, match='off its reference'):
        run(Plant(robot, {'rotor_inertia': np.full(6, 0.1)}, weak), wanted, rng)


def test_rigid_errors_are_possible_bodies_3_to_10_per_cent_off():
    robot = load_machine('panda')
    wrong = with_rigid_errors(robot, np.random.default_rng(4))
    error = np.abs(wrong.rigid_parameters[::10] / robot.rigid_parameters[::10] - 1.0)
    assert np.all((error > 0.029) & (error < 0.101))
    for inertia, described in zip(wrong.model.inertias[1:], robot.model.inertias[1:], strict=True):
        values = np.linalg.eigvalsh(inertia.inertia)
        possible = np.linalg.eigvalsh(described.inertia)
        assert values[0] > 0.0
        if possible[0] + possible[1] >= possible[2]:
            assert values[0] + values[1] > (1.0 - 1e-9) * values[2]
