# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What every test may ask for: recordings of real machines, and a ROS 2 domain of its own."""

import fcntl
import os
from pathlib import Path
import sys
import tempfile

import pytest

ROS_DOMAINS = range(1, 102)  # above 101 the ports of a domain are those Linux gives out itself


def claim_ros_domain():
    """
    Lock a ROS 2 domain id that no other test process of this machine has.

    Returns
    -------
    tuple of int and file
        The id, and the lock; it lasts until the file is closed, at the latest with the process.

    """
    folder = Path(tempfile.gettempdir(), 'armid_ros_domains')
    folder.mkdir(mode=0o777, exist_ok=True)
    for domain in ROS_DOMAINS:
        lock = open(folder / str(domain), 'w')
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        return domain, lock
    raise pytest.UsageError(f'all {len(ROS_DOMAINS)} ROS 2 domains are in use by other tests')


def pytest_configure(config):
    """Keep ROS 2 to this process and its children, before anything imports rclpy."""
    domain, config.ros_domain_lock = claim_ros_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ.setdefault('AMENT_PREFIX_PATH', sys.prefix)


@pytest.fixture(scope='session', autouse=True)
def ros_log_directory(tmp_path_factory):
    """Keep the logs of the nodes out of the home directory."""
    os.environ['ROS_LOG_DIR'] = str(tmp_path_factory.mktemp('ros_log'))


@pytest.fixture(scope='session')
def real_data():
    """
    Find the recordings of real machines.

    Returns
    -------
    Path
        The folder that the environment variable ARMID_DATA names; the test is skipped without.

    """
    folder = os.environ.get('ARMID_DATA')
    if not folder:
        pytest.skip('ARMID_DATA names no folder with recordings of real machines')
    if not Path(folder).is_dir():
        pytest.fail(f'ARMID_DATA is {folder}, which is no folder')
    return Path(folder)
