# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Recorded runs: what is said to be true is true, and how well an arm follows."""

from dataclasses import replace
import re

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect, parse_effect
from armid_ros.errors import ModelError, TrajectoryError
from armid_ros.motion import Motion
from armid_ros.robots import load_robot, Robot, robot_from_urdf
from armid_ros.simulation import (
    ComputedTorque,
    Elasticity,
    MotorControl,
    Plant,
    Reference,
    Sensors,
    simulate,
    SimulatedArm,
    SimulatedRun,
    step,
)
from armid_ros.simulation.controller import Controller
from armid_ros.simulation.elastic import make_simulated_arm, shipped_arm
from armid_ros.simulation.run import record
import numpy as np
import pytest

MIDDLE = np.array([0.3, -0.4, 0.2, 0.8, 0.1, 0.2])


@pytest.fixture(scope='module')
def arm(humanoid) -> ArmModel:
    """Return the arm with friction, rotors and a shared shaft in its wrist."""
    arm = ArmModel(humanoid)
    for name, values in (
        ('viscous_friction', [0.3, 0.3, 0.1, 0.1, 0.02, 0.02]),
        ('coulomb_friction', [0.4, 0.4, 0.2, 0.2, 0.05, 0.05]),
        ('rotor_inertia', [0.02, 0.02, 0.01, 0.01, 1e-3, 1e-3]),
        ('coupled_joint_friction', [1e-4, 1e-3, 0.02]),
        ('torque_offset', [0.1, -0.2, 0.1, 0.0, 0.01, 0.0]),
    ):
        arm = arm.with_effect(make_effect(name, humanoid), values)
    return arm


def swinging(robot: Robot, duration=3.0, count=61, rates=(1.5, 4.0)) -> Reference:
    t = np.linspace(0.0, duration, count)[:, np.newaxis]
    w = np.linspace(*rates, robot.n_joints)
    q = MIDDLE + 0.3 * np.cos(w * t)
    return Reference(
        robot.joints, t[:, 0], q, -0.3 * w * np.sin(w * t), -0.3 * w**2 * np.cos(w * t)
    )


@pytest.fixture(scope='module')
def run(arm) -> SimulatedRun:
    """Return a run with perfect sensors."""
    return simulate(arm, swinging(arm.robot), rng=np.random.default_rng(0))


def test_inverse_dynamics_of_the_true_motion_is_the_torque_that_caused_it(arm, run) -> None:
    dq = run.truth.dq
    shaft = dq[:, 4:5] + dq[:, 5:6]
    speeds = np.column_stack([dq, shaft])
    slipping = np.all(np.abs(speeds) > 0.02, axis=1)
    slipping[[0, -1]] = False
    error = arm.torque(run.truth)[slipping] - run.truth.tau[slipping]
    assert slipping.mean() > 0.4
    assert np.abs(error).max() < 1e-5 * np.abs(run.truth.tau).max()


def test_it_lasts_as_long_as_its_reference_at_the_rate_asked_for(arm) -> None:
    run = simulate(arm, swinging(arm.robot, 1.0), rng=np.random.default_rng(0), rate=200.0)
    np.testing.assert_allclose(run.t, np.arange(201) / 200.0, atol=1e-15)
    fine = simulate(arm, swinging(arm.robot, 1.0), rng=np.random.default_rng(0))
    np.testing.assert_array_equal(run.truth.q, fine.truth.q[::5])
    np.testing.assert_array_equal(run.tau, fine.tau[::5])


def test_delayed_torque_is_the_torque_of_some_steps_before(arm) -> None:
    reference = swinging(arm.robot, 0.5)
    late = simulate(arm, reference, rng=np.random.default_rng(0), sensors=Sensors(torque_delay=7))
    np.testing.assert_array_equal(late.tau[7:], late.truth.tau[:-7])
    np.testing.assert_array_equal(late.q, late.truth.q)


def test_what_does_not_fit_is_refused(arm) -> None:
    rng = np.random.default_rng(0)
    for rate in (0.0, -5.0, np.nan, 300.0):
        with pytest.raises(ModelError, match=f'{rate:g} Hz'):
            simulate(arm, swinging(arm.robot), rng=rng, rate=rate)
    far = Reference(arm.robot.joints, np.zeros(1), np.full((1, 6), 10.0))
    with pytest.raises(TrajectoryError, match='upper limit'):
        simulate(arm, far, rng=rng)


def sine(joints):
    t = np.arange(300) / 100.0
    angle = 2.0 * t[:, np.newaxis] + np.arange(len(joints))
    return Motion(joints, t, 0.1 * np.sin(angle), 0.2 * np.cos(angle), -0.4 * np.sin(angle))


@pytest.mark.parametrize('kind', ['revolute', 'continuous'])
def test_an_arm_of_one_joint_follows(pendulum, kind):
    """Without a range there is no middle of it, and no warning either."""
    robot = robot_from_urdf(pendulum().urdf.replace('revolute', kind))
    run = simulate(ArmModel(robot), sine(robot.joints), rng=np.random.default_rng(0))
    assert np.abs(run.truth.q - run.reference.q).max() < 1e-3


def test_a_joint_that_moves_nothing_cannot_be_simulated(pendulum):
    text = re.sub('<inertial>.*</inertial>', '', pendulum().urdf)
    with pytest.raises(ModelError, match=r"joint1'.* 'link1'"):
        Plant(ArmModel(robot_from_urdf(text)))


class Pushing(Controller):
    """Always more of what there is."""

    def torque(self, q, dq, desired, feedforward):
        """Return torque along the velocity."""
        return 1e3 * dq + 1.0


def test_an_arm_that_flies_away_does_not_follow_and_warns_of_nothing(pendulum):
    text = pendulum().urdf.replace('revolute', 'continuous').replace('"100"', '"1e300"')
    robot = robot_from_urdf(text)
    way, rng = sine(robot.joints), np.random.default_rng(0)
    with pytest.raises(ModelError, match='joint1'):
        simulate(ArmModel(robot), way, rng=rng, controller=Pushing())


def test_what_needs_springs_or_has_none_is_told_so():
    robot = load_robot('two_link_elastic')
    springs, rotors = (
        parse_effect(text, robot)
        for text in ('joint_elasticity:compliance=0.001', 'rotor_inertia:rotor_inertia=0.1')
    )
    arm = ArmModel(robot).with_effect(*springs).with_effect(*rotors)
    plant = Plant(arm, elasticity=Elasticity())
    with pytest.raises(ModelError, match='effects'):
        SimulatedArm(plant, rng=np.random.default_rng(0)).become(ArmModel(robot))
    with pytest.raises(ModelError, match='ComputedTorque'):
        MotorControl.of(Plant(arm))


def test_true_accelerations_of_motors_on_springs_are_those_of_their_samples() -> None:
    robot = load_robot('two_link_elastic')
    arm, drives = shipped_arm(robot)
    t = np.arange(0.0, 1.0, 0.01)
    q = np.column_stack([0.05 * np.sin(12.0 * t), 0.05 * np.sin(15.0 * t)])
    rng = np.random.default_rng(0)
    simulated = make_simulated_arm(arm, rng=rng, warn=print, drives=drives, start=q[0])
    truth = record(simulated, Reference(robot.joints, t, q)).truth
    n, central = len(truth.t), (truth.dq[2:] - truth.dq[:-2]) / (truth.t[2] - truth.t[0])
    # of the sample itself, of the one before and of the one after
    error = [np.abs(truth.ddq[1 + k : n - 1 + k] - central).mean() for k in (0, -1, 1)]
    assert np.argmin(error) == 0


def test_an_unknown_friction_costs_tracking_as_the_gains_say(slider) -> None:
    """At constant velocity the error is the friction over the stiffness, F / (m omega^2)."""
    robot = slider()
    arm = ArmModel(robot).with_effect(make_effect('coulomb_friction', robot), [10.0])
    reference = Reference(robot.joints, np.array([0.0, 2.0]), np.array([[0.0], [1.0]]))
    nominal = ComputedTorque(ArmModel(robot), bandwidth=20.0)
    run = simulate(arm, reference, rng=np.random.default_rng(0), controller=nominal)
    late = run.reference.q[-2] - run.truth.q[-2]
    assert late[0] == pytest.approx(10.0 / (2.0 * 20.0**2), rel=1e-3)


def test_computed_torque_closes_an_error_like_a_critically_damped_spring(humanoid) -> None:
    plant, omega = Plant(ArmModel(humanoid)), 20.0
    controller = ComputedTorque(ArmModel(humanoid), bandwidth=omega)
    still = np.zeros(6)
    state = plant.state(MIDDLE + 0.1)
    for _ in range(100):
        torque = controller.torque(state.q, state.dq, (MIDDLE, still, still), still)
        state = step(plant, state, torque)
    left = 0.1 * (1.0 + omega * state.t) * np.exp(-omega * state.t)
    np.testing.assert_allclose(state.q - MIDDLE, left, rtol=0.05)


def test_drives_give_no_more_torque_than_they_have(humanoid) -> None:
    needed = simulate(
        ArmModel(humanoid), swinging(humanoid, 4.0, 81), rng=np.random.default_rng(0)
    )
    assert np.abs(needed.truth.q - needed.reference.q).max() < 1.5e-4
    limit = 0.8 * np.abs(needed.truth.tau).max(axis=0)
    weak = ArmModel(replace(humanoid, torque_limit=limit))
    run = simulate(weak, swinging(humanoid, 4.0, 81), rng=np.random.default_rng(0))
    assert np.all(np.abs(run.truth.tau) <= limit)
    assert np.any(np.abs(run.truth.tau) == limit)
    assert np.abs(run.truth.q - run.reference.q).max() > 1e-3
