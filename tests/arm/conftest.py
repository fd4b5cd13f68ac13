# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The arm that the tests of models use."""

from armid_ros.robots import load_robot
import pytest


@pytest.fixture(scope='session')
def robot():
    return load_robot('humanoid_arm')
