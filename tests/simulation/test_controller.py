# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How well an arm follows what it is told, and what its drives do not have."""

from dataclasses import replace

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect
from armid_ros.simulation import ComputedTorque, Plant, Reference, simulate, step
import numpy as np
import pytest

from tests.simulation.test_run import MIDDLE, swinging


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
