# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Friction that holds, and lets go, as dry friction does; its complementarity solver."""

from itertools import product

from armid_ros.arm import ArmModel
from armid_ros.effects import make_effect, merge_actions
from armid_ros.errors import ModelError
from armid_ros.simulation import Plant, State, step
from armid_ros.simulation.contacts import solve_box_complementarity
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


def by_trying_everything(g, w_free, lower, upper) -> np.ndarray:
    for modes in product((-1, 0, 1), repeat=len(lower)):
        mode = np.array(modes)
        stuck = mode == 0
        f = np.where(mode > 0, upper, lower)
        f[stuck] = np.linalg.solve(
            g[np.ix_(stuck, stuck)], (w_free - g[:, ~stuck] @ f[~stuck])[stuck]
        )
        w = w_free - g @ f
        inside = np.all(f[stuck] >= lower[stuck]) and np.all(f[stuck] <= upper[stuck])
        if inside and np.all(w[~stuck] * mode[~stuck] >= 0.0):
            return f
    raise AssertionError('no solution')


@pytest.mark.parametrize('size', [1, 2, 3, 5])
def test_it_finds_the_one_solution_from_any_guess(size: int) -> None:
    rng = np.random.default_rng(size)
    for _ in range(60):
        root = rng.normal(size=(size, size))
        g = root @ root.T + 0.01 * np.eye(size)
        w_free = rng.normal(size=size) * 3.0
        lower, upper = -rng.uniform(0.1, 2.0, size), rng.uniform(0.1, 2.0, size)
        guess = tuple(rng.integers(-1, 2, size).tolist())
        f, _ = solve_box_complementarity(lower, upper, g, w_free, guess)
        np.testing.assert_allclose(
            f, by_trying_everything(g, w_free, lower, upper), rtol=1e-6, atol=1e-8
        )


def test_large_and_singular_problems_obey_the_law() -> None:
    rng = np.random.default_rng(3)
    for _ in range(100):
        directions = rng.integers(-1, 2, (14, 7)).astype(float)
        root = rng.normal(size=(7, 7))
        g = directions @ (root @ root.T + 0.01 * np.eye(7)) @ directions.T
        w_free = directions @ rng.normal(size=7) * 5.0
        bound = rng.uniform(0.01, 1.0, 14)
        guess = tuple(rng.integers(-1, 2, 14).tolist())
        f, modes = solve_box_complementarity(-bound, bound, g, w_free, guess)
        w = w_free - g @ f
        assert np.all(np.abs(f) <= bound * (1.0 + 1e-9))
        for speed, torque, limit, mode in zip(w, f, bound, modes, strict=True):
            if mode:
                assert torque == pytest.approx(mode * limit) and speed * mode >= -1e-6
            else:
                assert abs(speed) < 1e-6
