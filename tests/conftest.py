# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of all tests: recordings of real machines, robots, and a separate ROS 2 domain."""

from contextlib import ExitStack
from importlib.metadata import files
from itertools import chain
import os
from pathlib import Path
import random
import sys

import pytest

#: Slow rooms (subprocesses, ROS graphs, pages, many repeats), left out by `make test-fast`.
SLOW = set('benchmarks docsite examples fleet fuzz hidden live papers ros'.split())


def pytest_addoption(parser):
    """Add --seed, which shuffles the tests to find those that depend on their order."""
    parser.addoption('--seed', type=int, help='shuffle modules, and the tests of each')


def pytest_report_header(config):
    """Return a line on the seed of the order for the header."""
    seed = config.getoption('seed')
    return None if seed is None else f'order of the tests: --seed {seed}'


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Mark slow rooms; shuffle modules and their tests in the same way in every worker."""
    for item in items:
        if item.path.relative_to(Path(__file__).parent).parts[0] in SLOW:
            item.add_marker('slow')
    seed = config.getoption('seed')
    if seed is not None:
        rng, modules = random.Random(seed), {}
        for item in items:
            modules.setdefault(item.path, []).append(item)
        groups = [rng.sample(own, len(own)) for own in modules.values()]
        items[:] = chain.from_iterable(rng.sample(groups, len(groups)))


def pytest_configure(config):
    """Restrict ROS 2 to this process and its children, before a context is made."""
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.setdefault('AMENT_PREFIX_PATH', sys.prefix)
    from armid_ros.nodes.running.domains import reserved_domain

    config.ros_domain = ExitStack()
    os.environ['ROS_DOMAIN_ID'] = str(config.ros_domain.enter_context(reserved_domain()))


def pytest_unconfigure(config):
    """Release the ROS 2 domain."""
    config.ros_domain.close()


@pytest.fixture(scope='session', autouse=True)
def ros_log_directory(tmp_path_factory):
    """Write the logs of nodes to a temporary folder."""
    os.environ['ROS_LOG_DIR'] = str(tmp_path_factory.mktemp('ros_log'))


@pytest.fixture(scope='session')
def real_data():
    """
    Find the recordings of real machines.

    Returns
    -------
    Path
        The folder in the environment variable ARMID_DATA; without it, the test is skipped.

    """
    folder = os.environ.get('ARMID_DATA')
    if not folder:
        pytest.skip('ARMID_DATA names no folder with recordings of real machines')
    if not Path(folder).is_dir():
        pytest.fail(f'ARMID_DATA is {folder}, which is no folder')
    return Path(folder)


@pytest.fixture(scope='session')
def example_robot():
    """Return a function that finds a URDF of example-robot-data by its file name."""
    paths = [entry for entry in files('example-robot-data') or () if entry.suffix == '.urdf']

    def find(name):
        return next(Path(str(path.locate())) for path in paths if path.name == name)

    return find


@pytest.fixture(scope='session')
def humanoid():
    """Return the shipped humanoid arm on Earth."""
    from armid_ros.robots import load_robot

    return load_robot('humanoid_arm')


@pytest.fixture(scope='session')
def robot(humanoid):
    """Return the arm of rooms that have no other one."""
    return humanoid
