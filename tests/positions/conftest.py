# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the arms of the fits hide."""

from dataclasses import replace

import numpy as np
import pytest

from tests.positions.machine import Secret


@pytest.fixture(scope='module')
def secret(robot):
    drawn = Secret.draw(robot, np.random.default_rng(4))
    center = np.array([0.02, -0.03, 0.1])
    return replace(drawn, delay=0.012, mass=0.5, center=center, noise=5e-5, velocities=True)
