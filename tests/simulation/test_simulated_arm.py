# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The arm that stands there: holds, follows, refuses, and is where `simulate` would have it."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.errors import TrajectoryError
from armid_ros.simulation import Reference, Sensors, simulate, SimulatedArm
import numpy as np
import pytest

from tests.simulation.test_run import MIDDLE

SENSORS = Sensors(
    torque_noise=0.05,
    position_noise=1e-5,
    resolution=1e-4,
    torque_delay=3,
)


@pytest.fixture
def model(humanoid) -> ArmModel:
    """Return the shipped arm with friction."""
    arm = ArmModel(humanoid)
    return arm.with_effect(
        make_effect('coulomb_friction', humanoid), [0.4, 0.4, 0.2, 0.2, 0.05, 0.05]
    )


@pytest.fixture
def arm(model) -> SimulatedArm:
    """Return the arm at its home pose, with sensors that have every fault."""
    return SimulatedArm(model, rng=np.random.default_rng(0), sensors=SENSORS, start=MIDDLE)


def there_and_back(joints, duration: float = 1.5, first: float = 0.0) -> Reference:
    """Return a smooth excursion from home that starts and ends at rest."""
    t = np.linspace(0.0, duration, 31)[:, np.newaxis]
    w = 2.0 * np.pi / duration
    reach = 0.1 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    q = MIDDLE + reach * (1.0 - np.cos(w * t))
    dq, ddq = reach * w * np.sin(w * t), reach * w**2 * np.cos(w * t)
    return Reference(joints, first + t[:, 0], q, dq, ddq)


def test_noise_and_delay_are_those_of_simulate_sample_by_sample(model) -> None:
    reference = there_and_back(model.robot.joints)
    rng = np.random.default_rng(3)
    run = simulate(model, reference, rng=rng, sensors=SENSORS, rate=200.0)
    rng = np.random.default_rng(3)
    arm = SimulatedArm(model, rng=rng, sensors=SENSORS, start=MIDDLE)
    arm.set_trajectory(reference)
    rng.standard_normal((1, 3, 6))  # the sample at time zero, which a stepped arm does not take
    samples = [arm.advance(5) for _ in range(len(run.t) - 1)]
    np.testing.assert_allclose([s.t for s in samples], run.t[1:], atol=1e-15)
    np.testing.assert_allclose([s.q for s in samples], run.q[1:], atol=1e-8)
    np.testing.assert_allclose([s.tau for s in samples], run.tau[1:], atol=1e-6)
    np.testing.assert_allclose([s.dq for s in samples], run.dq[1:], atol=1e-6)


def test_steps_ahead_of_the_present_change_neither_samples_nor_commands(model) -> None:
    reference, samples = there_and_back(model.robot.joints), []
    for looks in (False, True):  # reading the state ends the steps ahead
        arm = SimulatedArm(model, rng=np.random.default_rng(3), sensors=SENSORS, start=MIDDLE)
        arm.set_trajectory(reference)
        rows = []
        for step in range(400):
            if step == 117:
                arm.become(model.with_theta(1.01 * model.theta))
            if step == 333:
                arm.set_trajectory(Reference(arm.joints, np.array([0.5]), MIDDLE[np.newaxis]))
            sample = arm.advance(1)
            assert sample.steps == arm.steps == step + 1
            rows.append(np.concatenate([sample.q, sample.dq, sample.tau]))
            if looks:
                assert arm.state.steps == step + 1
        samples.append(rows)
    np.testing.assert_array_equal(*samples)


def bad_trajectories(joints):
    """Return trajectories that must be refused, with what the message has to say."""
    still = np.zeros((2, 6))
    home = np.stack([MIDDLE, MIDDLE])
    t = np.array([0.0, 1.0])
    rushed, coasting = home.copy(), still.copy()
    rushed[1, 3] += 0.8
    coasting[1, 2] = 0.5
    return [
        (Reference(joints, 0.2 * t, rushed, still), rf"'{joints[3]}'.*velocity"),
        (Reference(joints, t, home, coasting), rf"at the end.*'{joints[2]}' is 0.5 rad/s"),
        (Reference(joints, t, home, coasting[::-1]), rf"velocity step.*'{joints[2]}'"),
        (Reference(joints, t, home + 0.1, still), r'0\.1 rad.*later'),
        (Reference(joints[:-1], t, home[:, :-1]), f"'{joints[-1]}'"),
    ]


@pytest.mark.parametrize('which', range(5))
def test_a_refused_trajectory_leaves_the_arm_with_what_it_was_doing(arm, model, which) -> None:
    twin = SimulatedArm(model, rng=np.random.default_rng(0), sensors=SENSORS, start=MIDDLE)
    for each in (arm, twin):
        each.advance(100)
    bad, message = bad_trajectories(arm.joints)[which]
    with pytest.raises(TrajectoryError, match=message):
        arm.set_trajectory(bad)
    for each in (arm, twin):
        each.set_trajectory(there_and_back(each.joints))
        each.advance(300)
    with pytest.raises(TrajectoryError):
        arm.set_trajectory(bad)
    one, other = arm.advance(400), twin.advance(400)
    np.testing.assert_array_equal(one.q, other.q)
    np.testing.assert_array_equal(one.tau, other.tau)


def test_reset_brings_it_home_and_forgets_the_trajectory(arm) -> None:
    arm.set_trajectory(there_and_back(arm.joints))
    arm.advance(600)
    arm.reset()
    assert (arm.state.steps, arm.state.t) == (0, 0.0)
    arm.advance(500)
    np.testing.assert_array_equal(arm.state.q, MIDDLE)
    arm.reset(steps=2000)
    assert arm.advance().t == 2.001


def test_time_only_goes_forwards(arm) -> None:
    with pytest.raises(ValueError, match='1 step'):
        arm.advance(0)
