# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gait of the shipped pair of legs."""

from armid_ros.papers.exo.plant.gait_cycle import gait_cycle, GaitCycle
from armid_ros.papers.exo.plant.walkers import walking_pair
import pytest

from tests.ros.conftest import bench

__all__ = ['bench']


@pytest.fixture(scope='session')
def cycle() -> GaitCycle:
    return gait_cycle(walking_pair())
