# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Motors that drive links through springs: frequencies, energy, friction, limits, and MuJoCo."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError
from armid_ros.papers.elastic.experiments import run_experiment, step_experiments, step_of_velocity
from armid_ros.robots import load_robot
from armid_ros.robots.two_link import two_link_set
from armid_ros.simulation import Elasticity, Plant, step
from armid_ros.simulation.elastic import two_link_arm, two_link_loop
import numpy as np
import pytest

from tests.papers.elastic.two_link_in_mujoco import (
    FREE,
    LOCKED,
    MANY,
    modes,
    mujoco_arm,
    run_mujoco,
)

SHIPPED = two_link_set('after')


def two_link_plant(parameters, substeps=2):
    """Return the plant of the two-link arm with elastic joints."""
    elasticity = Elasticity(substeps, parameters.link_damping)
    return Plant(two_link_arm(parameters), elasticity=elasticity)


def lossless():
    """Return the shipped parameters without any friction or damping."""
    zero = np.zeros(2)
    return replace(
        SHIPPED.parameters,
        link_damping=zero,
        motor_damping=zero,
        spring_damping=zero,
        coulomb=zero,
    )


@pytest.mark.parametrize(
    ('locked', 'table'), [(False, FREE), (True, LOCKED)], ids=['free', 'locked']
)
def test_modes_with_free_and_locked_motors_are_those_of_the_literature(locked, table) -> None:
    plant = two_link_plant(SHIPPED.parameters)
    for pose, wanted in table.items():
        found = modes(plant, np.array([0.0, np.radians(pose)]), locked=locked)
        np.testing.assert_allclose(found[:, 0], wanted, atol=0.05)


def test_vibration_has_the_frequency_of_the_linear_system_at_1_khz() -> None:
    """One substep of 1 ms, 16 samples a period: what is left is a few 1e-5."""
    plant = two_link_plant(lossless(), substeps=1)
    q = np.array([0.0, np.pi / 2])
    arm, coupling = SHIPPED.parameters, SHIPPED.parameters.gamma * np.cos(q[1])
    inertia = np.diag([*arm.rotor, arm.alpha, 0.0])
    inertia[2:, 2:] += arm.beta + coupling * np.array([[2.0, 1.0], [1.0, 0.0]])
    spring = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.diag(arm.stiffness))
    squared, shapes = np.linalg.eig(np.linalg.solve(inertia, spring))
    highest = int(np.argmax(squared))
    omega, shape = np.sqrt(squared[highest]), 1e-6 * shapes[:, highest]
    state = plant.state(q)
    state.rotors.twist[:] = shape[:2] - shape[2:]
    twist = []
    for _ in range(1000):
        state = step(plant, state, np.zeros(2))
        twist.append(state.rotors.twist[0])
    t = 1e-3 * np.arange(1, 1001)
    wanted = (shape[0] - shape[2]) * np.cos(omega * t)
    assert np.abs(np.array(twist) - wanted).max() < 0.03 * np.abs(wanted).max()


@pytest.mark.parametrize('stiffness', [1e6, 1e9])
def test_no_spring_is_too_stiff_for_1_khz(stiffness) -> None:
    """A spring far beyond what a step resolves makes the arm rigid, not unstable."""
    robot = load_robot('two_link_elastic')
    rotor = np.array([1.5, 0.7])
    drives = ArmModel(robot).with_effect(make_effect('rotor_inertia', robot), rotor)
    springs = make_effect('joint_elasticity', robot).with_shape([[1e-3]])
    arm = drives.with_effect(springs, np.full(2, 1.0 / stiffness))
    elastic, rigid = Plant(arm, elasticity=Elasticity()), Plant(drives)
    soft, hard = elastic.state([0.0, 1.0]), rigid.state([0.0, 1.0])
    for k in range(1000):
        torque = np.array([20.0, -10.0]) * np.cos(0.01 * k)
        soft, hard = step(elastic, soft, torque), step(rigid, hard, torque)
    np.testing.assert_allclose(soft.q, hard.q, atol=1e-3)
    np.testing.assert_allclose(soft.dq, hard.dq, atol=2e-3)


def test_backlash_lets_the_link_fly_between_its_flanks() -> None:
    """Within the gap no torque reaches the link."""
    robot = load_robot('two_link_elastic')
    arm = ArmModel(robot)
    for name, values in (
        ('rotor_inertia', np.full(2, 1.0)),
        ('joint_elasticity', np.full(2, 1e-5)),
        ('backlash', np.full(2, 0.02)),
    ):
        arm = arm.with_effect(make_effect(name, robot), values)
    plant = Plant(arm, elasticity=Elasticity())
    state = plant.state([0.0, 0.0])
    for _ in range(40):
        state = step(plant, state, np.array([5.0, 5.0]))
    assert np.all(np.abs(state.rotors.twist) < 0.01)
    np.testing.assert_array_equal(state.dq, 0.0)
    for _ in range(100):
        state = step(plant, state, np.array([5.0, 5.0]))
    assert np.abs(state.dq).max() > 1e-3


def test_step_response_is_that_of_the_literature() -> None:
    reference = step_of_velocity(np.zeros(2), np.array([0.5, 0.0]))
    run = run_experiment(reference, SHIPPED, np.random.default_rng(0))
    first, second = run.link.dq.T
    assert 1e3 * run.link.t[np.argmax(first > 0.45)] == pytest.approx(68.0, abs=3.0)
    assert 100.0 * (first.max() / 0.5 - 1.0) == pytest.approx(24.7, abs=2.0)
    assert np.abs(second).max() == pytest.approx(0.1, abs=0.02)


def test_a_motor_without_inertia_is_refused_by_name() -> None:
    robot = load_robot('two_link_elastic')
    arm = ArmModel(robot).with_effect(make_effect('joint_elasticity@joint2', robot), [1e-4])
    with pytest.raises(ModelError, match="'joint2'"):
        Plant(arm, elasticity=Elasticity())


def test_a_link_that_is_pushed_against_its_limit_is_held_there() -> None:
    plant = two_link_plant(SHIPPED.parameters)
    limit = plant.robot.upper[0]
    state = plant.state([limit - 0.2, 0.3])
    farthest = 0.0
    for _ in range(1500):
        state = step(plant, state, np.array([50.0, 0.0]))
        farthest = max(farthest, state.q[0])
    assert limit < farthest < limit + 0.02
    np.testing.assert_allclose(state.dq, 0.0, atol=1e-3)
    assert state.rotors.twist[0] > 0.0  # the spring is wound up by what the motor still gives


@pytest.mark.parametrize('number', [0, 3])
def test_steps_move_both_alike(number) -> None:
    """The error of MuJoCo itself at 5 us is about 1e-4 rad/s, falling with the first power."""
    shipped = two_link_set('after')
    experiment = step_experiments()[number]
    loop = two_link_loop(shipped)
    ours = run_experiment(experiment, shipped, np.random.default_rng(0))
    theirs = run_mujoco(mujoco_arm(shipped.parameters, MANY), loop, experiment)
    assert np.ptp(ours.link.dq, axis=0).max() > 1.0
    count = len(theirs.link)
    np.testing.assert_allclose(ours.link.dq[:count], theirs.link.dq, atol=3e-4)
    np.testing.assert_allclose(ours.motor.dq[:count], theirs.motor.dq, atol=3e-4)
    np.testing.assert_allclose(ours.link.q[:count], theirs.link.q, atol=5e-5)
