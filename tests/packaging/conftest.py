# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Folders of the source tree and of the installation."""

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
    """Return the distribution that pip installed; skip the test if it did not."""
    site_packages = [sysconfig.get_path('purelib')]  # not the source tree, which has metadata too
    for installed in metadata.distributions(name='armid_ros', path=site_packages):
        return installed
    pytest.skip('armid_ros is not installed in this environment: run make')


@pytest.fixture(scope='session')
def prefix(distribution):
    """Return the prefix of the installation of armid_ros."""
    return Path(sys.prefix)
