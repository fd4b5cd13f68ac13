# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The complementarity solver against trying everything."""

from itertools import product

from armid_ros.simulation.contacts import solve_box_complementarity
import numpy as np
import pytest


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
