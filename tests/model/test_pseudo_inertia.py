# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
from armid_ros.model.pseudo_inertia import (
    Consistency,
    link_parameters,
    pseudo_inertia,
)
import numpy as np
import pytest


def point_masses(masses, places):
    """Return the ten parameters of point masses from their definition."""
    inertia = sum(
        m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, places, strict=True)
    )
    upper = [inertia[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return np.array([masses.sum(), *(masses @ places), *upper])


@pytest.fixture
def cloud():
    rng = np.random.default_rng(0)
    return rng.uniform(0.1, 1.0, 6), rng.normal(size=(6, 3))


def test_pseudo_inertia_is_the_second_moment_of_homogeneous_coordinates(cloud):
    masses, places = cloud
    homogeneous = np.column_stack([places, np.ones(len(places))])
    expected = np.einsum('k,ki,kj->ij', masses, homogeneous, homogeneous)
    pi = point_masses(masses, places)
    np.testing.assert_allclose(pseudo_inertia(pi), expected, rtol=1e-12)
    pair = np.array([pi, 2.0 * pi])
    np.testing.assert_allclose(link_parameters(pseudo_inertia(pair)), pair, rtol=1e-12)


def test_mass_centre_and_moments_are_those_about_the_centre(cloud):
    masses, places = cloud
    center = masses @ places / masses.sum()
    found = Consistency.of('cloud', point_masses(masses, places))
    central = Consistency.of('cloud', point_masses(masses, places - center))
    np.testing.assert_allclose(found.center, center)
    np.testing.assert_allclose(found.moments, central.moments)
    assert found.consistent


def test_a_violated_triangle_inequality_is_no_body():
    """Moments 1, 1, 3 are positive, but no mass distribution has them."""
    found = Consistency.of('plate', [1.0, 0, 0, 0, 1.0, 0, 1.0, 0, 0, 3.0])
    assert not found.consistent
    assert found.moments[0] + found.moments[1] < found.moments[2]
