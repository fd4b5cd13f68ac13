# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction that holds, and lets go, as dry friction does."""

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect, merge_actions
from armid_ros.errors import ModelError
from armid_ros.simulation import Plant, State, step
import numpy as np
import pytest


def run(plant: Plant, state: State, seconds: float, torque) -> list[State]:
    passed = [state]
    for _ in range(round(seconds / plant.dt)):
        passed.append(step(plant, passed[-1], np.asarray(torque)))
    return passed


@pytest.mark.parametrize('parts', [[0.1, 0.2, -0.3], [0.3, -0.1, -0.2]])
def test_friction_that_sums_to_zero_is_none_however_it_is_rounded(slider, parts):
    """Floats leave 5e-17 N of one sum and -3e-17 N, which would push, of the other."""
    robot = slider()
    kinds = [
        make_effect('coulomb_friction', robot).action(np.array([part]), ArmModel(robot))
        for part in parts
    ]
    assert sum(parts) != 0.0 and merge_actions(robot, kinds).dry_friction.directions.size == 0


def with_coulomb(robot, values) -> ArmModel:
    return ArmModel(robot).with_effect(make_effect('coulomb_friction', robot), values)


def test_asymmetric_levels_hold_between_both(slider) -> None:
    robot = slider()
    arm = with_coulomb(robot, [10.0]).with_effect(
        make_effect('asymmetric_friction', robot), [4.0, 0.0]
    )
    plant = Plant(arm)
    for push, moves in ((13.9, 0), (14.1, 1), (-5.9, 0), (-6.1, -1)):
        assert np.sign(run(plant, plant.state([0.0]), 0.5, [push])[-1].dq[0]) == moves


def test_a_shared_shaft_sticks_along_its_direction_only(pendulum) -> None:
    robot = pendulum(links=2, axis='0 0 1')
    arm = ArmModel(robot).with_effect(
        make_effect('coupled_joint_friction', robot), [0.0, 0.0, 5.0]
    )
    plant = Plant(arm)
    final = run(plant, plant.state([0.1, 0.2]), 1.0, [0.004, -0.002])[-1]
    assert final.dq[0] == -final.dq[1] != 0.0
    assert final.q.sum() == pytest.approx(0.3, abs=1e-14)
    assert np.all(run(plant, plant.state([0.1, 0.2]), 1.0, [6.0, 6.0])[-1].dq.sum() > 0.0)


def test_two_joints_and_their_shared_shaft_can_stick_together(pendulum) -> None:
    """Three elements on two joints: their torques are undetermined, the motion is not."""
    robot = pendulum(links=2, axis='0 0 1')
    arm = with_coulomb(robot, [1.0, 1.0]).with_effect(
        make_effect('coupled_joint_friction', robot), [0.0, 0.0, 2.0]
    )
    plant = Plant(arm)
    start = plant.state([0.1, 0.2])
    for torque in ([2.99, 2.99], [0.99, -0.99], [2.99, 1.01], [-2.99, -2.99]):
        final = run(plant, start, 1.0, torque)[-1]
        np.testing.assert_array_equal(final.q, start.q)
        np.testing.assert_array_equal(final.dq, [0.0, 0.0])
    for torque in ([3.01, 3.01], [1.01, -1.01], [4.01, 0.0], [3.01, 0.99]):
        assert np.any(run(plant, start, 0.1, torque)[-1].dq != 0.0)


def test_friction_with_negative_width_is_refused(slider) -> None:
    with pytest.raises(ModelError, match='friction'):
        Plant(with_coulomb(slider(), [-1.0]))
