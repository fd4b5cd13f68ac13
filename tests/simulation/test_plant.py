# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The plant without friction that sticks, against closed forms and against energy."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import ModelError, TrajectoryError
from armid_ros.simulation import Plant, State, step
import numpy as np
import pinocchio as pin
import pytest
from scipy.special import ellipk


def states(plant: Plant, state: State, n_steps: int, torque=None) -> list[State]:
    """Return the states after 0, 1, ... steps under a constant torque."""
    torque = np.zeros(plant.robot.n_joints) if torque is None else np.asarray(torque)
    passed = [state]
    for _ in range(n_steps):
        passed.append(step(plant, passed[-1], torque))
    return passed


def energy(plant: Plant, state: State) -> float:
    model = plant.robot.model
    return pin.computeMechanicalEnergy(model, model.createData(), state.q, state.dq)


@pytest.mark.parametrize('amplitude', [0.01, 2.5])
def test_a_pendulum_swings_with_its_period(pendulum, amplitude: float) -> None:
    plant = Plant(ArmModel(pendulum()))
    inertia = 0.01 + 1.0 * 0.4**2
    period = 4.0 * np.sqrt(inertia / (1.0 * 9.81 * 0.4)) * ellipk(np.sin(amplitude / 2) ** 2)
    swing = states(plant, plant.state([amplitude]), round(5.2 * period / plant.dt))
    q = np.array([s.q[0] for s in swing])
    before = np.flatnonzero((q[:-1] > 0.0) & (q[1:] <= 0.0))
    crossing = (before + q[before] / (q[before] - q[before + 1])) * plant.dt
    assert np.diff(crossing).mean() == pytest.approx(period, rel=1e-5)


def test_the_integration_is_second_order_in_the_step(humanoid) -> None:
    arm = ArmModel(humanoid).with_effect(
        make_effect('viscous_friction', humanoid), [0.3, 0.3, 0.1, 0.1, 0.005, 0.005]
    )
    torque = np.array([0.5, -1.0, 0.2, 0.1, 0.01, -0.01])

    def end(dt: float) -> np.ndarray:
        plant = Plant(arm, dt=dt, hard_stops=False)
        return states(plant, plant.state(np.full(6, 0.3)), round(0.4 / dt), torque)[-1].q

    best = end(5e-5)
    errors = [np.linalg.norm(end(dt) - best) for dt in (2e-3, 1e-3, 5e-4)]
    assert errors[1] < 1e-4
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.1)
    np.testing.assert_allclose(errors[1] / errors[2], 4.0, rtol=0.1)


@pytest.mark.parametrize('damping', [0.1, 20.0, 2e3, 1e6])
def test_viscous_friction_decays_exponentially_however_stiff(slider, damping: float) -> None:
    robot = slider()
    arm = ArmModel(robot).with_effect(make_effect('viscous_friction', robot), [damping])
    plant = Plant(arm)
    slow = states(plant, plant.state([0.0], [1.0]), 200)
    t = np.array([s.t for s in slow])
    dq = np.array([s.dq[0] for s in slow])
    np.testing.assert_allclose(dq, np.exp(-damping / 2.0 * t), rtol=1e-6, atol=1e-12)
    assert np.all(dq >= 0.0)


def test_asymmetric_friction_alone_is_an_offset_and_never_holds(slider) -> None:
    robot = slider()
    arm = ArmModel(robot).with_effect(make_effect('asymmetric_friction', robot), [4.0, 0.0])
    plant = Plant(arm)
    assert states(plant, plant.state([0.0]), 1000)[-1].dq[0] == pytest.approx(-2.0, rel=1e-12)


def test_a_joint_stops_at_its_limit_and_stays_until_it_is_pushed_off(pendulum) -> None:
    plant = Plant(ArmModel(pendulum(links=2, stop=0.5)))
    swing = states(plant, plant.state([0.4, 0.4], [3.0, 2.0]), 300, [20.0, 5.0])
    q = np.array([s.q for s in swing])
    assert q.max() <= 0.5 and q.min() >= -0.5
    np.testing.assert_array_equal(swing[-1].q, [0.5, 0.5])
    np.testing.assert_array_equal(swing[-1].dq, [0.0, 0.0])
    one = Plant(ArmModel(pendulum(stop=0.5)))
    assert states(one, one.state([0.5]), 50, [-1.0])[-1].q[0] < 0.5
    assert states(one, one.state([0.5]), 50, [3.0])[-1].q[0] == 0.5


def test_hitting_a_stop_gains_no_energy(pendulum) -> None:
    plant = Plant(ArmModel(pendulum(links=3, stop=0.7)))
    swing = states(plant, plant.state([0.6, 0.0, -0.6], [0.0, 4.0, 0.0]), 3000)
    values = np.array([energy(plant, s) for s in swing])
    assert np.diff(values[1:]).max() < 1e-5
    assert values[-1] < values[0] - 0.5


def test_an_arm_cannot_begin_beyond_its_stops(pendulum) -> None:
    with pytest.raises(TrajectoryError, match=r"'joint1'.*0\.6.*-0\.5.*0\.5"):
        Plant(ArmModel(pendulum(stop=0.5))).state([0.6])
    Plant(ArmModel(pendulum(stop=0.5)), hard_stops=False).state([0.6])
    assert Plant(ArmModel(pendulum(stop=0.5))).state([0.5 + 1e-9]).q[0] == 0.5


def test_bodies_that_cannot_be_are_refused(slider) -> None:
    robot = slider()
    with pytest.raises(ModelError, match=r"'block'.*--physical"):
        Plant(ArmModel(robot.with_inertias(-robot.rigid_parameters)))
    with pytest.raises(ModelError, match='positive time'):
        Plant(ArmModel(robot), dt=0.0)
