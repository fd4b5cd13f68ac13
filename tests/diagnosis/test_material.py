# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A cause matters if it is material in a joint, and shows beside the misfit of all joints."""

from types import SimpleNamespace

from armid_ros.diagnosis.search.acceptance import material
import numpy as np
import pytest

#: Least squares of two joints by the share of the misfit that is asked for.
LEAST = {0.0: np.array([10.0, 30.0]), 1.0: np.array([100.0, 100.0])}
HERE = SimpleNamespace(
    settings=None, evidence=SimpleNamespace(least_squares=lambda settings, share: LEAST[share])
)


@pytest.mark.parametrize(
    'gains, material_at_all, beside_misfit',
    [
        ((9.0, 29.0), False, False),
        ((11.0, 0.0), True, False),
        ((60.0, 30.0), True, False),
        ((60.0, 50.0), True, True),  # less than the misfit of each joint, more than of both
        ((0.0, 101.0), True, True),
        ((150.0, -90.0), True, True),  # what is worse in one joint is no less of it in another
    ],
)
def test_power_over_that_of_the_misfit_is_summed_over_joints(
    gains, material_at_all, beside_misfit
):
    assert material(np.array(gains), HERE, 0.0) is material_at_all
    assert material(np.array(gains), HERE, 1.0) is beside_misfit
