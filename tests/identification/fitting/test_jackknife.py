# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where noise is white the jackknife has the variance of least squares, whoever moves when."""

from armid_ros.identification.fitting.jackknife import jackknife
import numpy as np
import pytest

ROWS, DRAWS = 10, 1500


def fits(parts, noise):
    """Return values and deviations of a fit to all parts, and to all but each."""
    own = np.array([x.T @ x for x in parts])
    aim = np.array([x.T @ y for x, y in zip(parts, noise, strict=True)])

    def fit(left):
        inverse = np.linalg.pinv(own[left].sum(axis=0), hermitian=True)
        return inverse @ aim[left].sum(axis=0), np.sqrt(np.diag(inverse))

    held = [fit(np.arange(len(parts)) != k) for k in range(len(parts))]
    values, std = fit(np.full(len(parts), True))
    return values, std, np.array([one[0] for one in held]), np.array([one[1] for one in held])


@pytest.mark.slow
@pytest.mark.parametrize('size', [1, 2, 4])
@pytest.mark.parametrize('loud', [(1, 1, 1, 1, 1, 1), (1, 1, 1, 1, 1, 10), (1, 1, 1, 1, 5, 10)])
def test_white_noise_gives_the_variance_of_least_squares(size, loud):
    rng = np.random.default_rng(0)
    parts = [factor * rng.normal(size=(ROWS, size)) for factor in loud]
    found = np.zeros(size)
    for _ in range(DRAWS):
        values, std, *held = fits(parts, rng.normal(size=(len(parts), ROWS)))
        found += jackknife(values, std, *held) / DRAWS
    assert found == pytest.approx(std**2, rel=0.2)


def test_a_part_without_which_nothing_tells_a_value_counts_nothing():
    rng = np.random.default_rng(1)
    first, second = np.eye(2)[:1], np.eye(2)[1:]  # the second value is told by one part alone
    parts = [first * rng.normal(size=(ROWS, 1)) for _ in range(4)]
    parts.append(second * rng.normal(size=(ROWS, 1)))
    found = jackknife(*fits(parts, rng.normal(size=(5, ROWS))))
    assert found[1] == 0.0 < found[0]


def test_noise_that_lasts_makes_values_less_sure():
    rng = np.random.default_rng(2)
    parts = list(rng.normal(size=(8, ROWS, 1)) + 1.0)
    ratio = []
    for _ in range(DRAWS):
        values, std, *held = fits(parts, [np.full(ROWS, rng.normal()) for _ in parts])
        ratio.append(jackknife(values, std, *held)[0] / std[0] ** 2)
    rows, power = (np.array([f(x) for x in parts]) for f in (np.sum, lambda x: np.sum(x**2)))
    assert np.mean(ratio) == pytest.approx(np.sum(rows**2) / power.sum(), rel=0.1)
