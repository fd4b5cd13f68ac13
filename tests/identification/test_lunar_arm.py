# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The first paper: gravity and inertia of the humanoid arm on the moon, from noisy torques."""

import pytest

from benchmarks import lunar_arm


@pytest.mark.long
@pytest.mark.slow
def test_the_papers_arm_is_identified_better_than_in_the_paper():
    """Wanted: 1 % of the peak torque on average, 1.5 % of each joint, the load within 10 g."""
    errors, load = lunar_arm.run()
    for table in errors.values():
        assert table.mean() <= 1.0
        assert table.mean(axis=0).max() <= 1.5
    assert abs(load - lunar_arm.LOAD) < 0.01
