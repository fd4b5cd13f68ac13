# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A small fleet in bags, and a cluster of two processes."""

from armid_ros.fleet.cluster import connected
from armid_ros.fleet.plan import FleetSettings, plan_fleet
from armid_ros.fleet.run import identify_fleet
import pytest

from tests.golden.simulated_fleet import EFFECTS, generate, ROBOT

SETTINGS = FleetSettings(EFFECTS)
URDF = str(ROBOT)


def identified(client, bags, robots, out, settings, *tell):
    """Plan and run the identification of a fleet; return its outcome."""
    return identify_fleet(client, bags, plan_fleet(bags, robots, out, settings), *tell)


@pytest.fixture(scope='session')
def bags(tmp_path_factory):
    """Return a folder with undamaged bags of three unchanged arms, three each."""
    folder = tmp_path_factory.mktemp('fleet')
    generate(folder, arms=3, bags=3, changed=0, damaged=0, seconds=12.0)
    return folder


@pytest.fixture(scope='session')
def cluster():
    """Return a client of two worker processes."""
    with connected(None, 2) as client:
        yield client
