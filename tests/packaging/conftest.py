# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the source tree is, and where it has been installed."""

from importlib import metadata
from pathlib import Path
import sys
import sysconfig

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope='session')
def root():
    """Return the folder of package.xml."""
    return ROOT


@pytest.fixture(scope='session')
def distribution():
    """Return what pip installed in this environment; skip the test where it has not."""
    site_packages = [sysconfig.get_path('purelib')]  # not the source tree, which has metadata too
    for installed in metadata.distributions(name='armid_ros', path=site_packages):
        return installed
    pytest.skip('armid_ros is not installed in this environment: run make')


@pytest.fixture(scope='session')
def prefix(distribution):
    """Return the prefix that armid_ros is installed in."""
    return Path(sys.prefix)
