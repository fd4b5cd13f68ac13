# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The ground of Table 3."""

from armid_ros.papers.exo.plant.walkers import ground_force
import numpy as np
import pytest


def test_a_millimetre_deep_is_a_hundred_newton() -> None:
    force = ground_force(np.array(-1e-3), np.array(0.0), np.array(0.0))
    np.testing.assert_allclose(force, [0.0, 100.0], rtol=1e-12)


def test_nothing_acts_above_the_ground_and_nothing_pulls() -> None:
    above = ground_force(np.array(1e-6), np.array(-3.0), np.array(1.0))
    leaving = ground_force(np.array(-1e-3), np.array(2.0), np.array(1.0))
    np.testing.assert_array_equal(above, [0.0, 0.0])
    np.testing.assert_array_equal(leaving, [0.0, 0.0])


def test_the_damper_works_from_the_first_touch() -> None:
    force = ground_force(np.array(-1e-9), np.array(-0.2), np.array(0.0))
    assert force[1] == pytest.approx(200.0, rel=1e-4)


@pytest.mark.parametrize('sliding', [-1.0, 1.0])
def test_friction_opposes_sliding_and_has_a_bound(sliding: float) -> None:
    ahead, up = ground_force(np.array(-2e-3), np.array(0.0), np.array(sliding))
    assert ahead == pytest.approx(-0.3 * sliding * up)
