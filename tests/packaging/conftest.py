# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fixtures with the folders of the source tree and of the installation."""

from importlib import metadata
from pathlib import Path
import sys
import sysconfig

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope='session')
def root():
    """Return the root of the source tree, which contains package.xml."""
    return ROOT


@pytest.fixture(scope='session')
def distribution():
    """Return the distribution installed by pip; skip the test if there is none."""
    site_packages = [sysconfig.get_path('purelib')]  # not the source tree, which has metadata too
    for installed in metadata.distributions(name='armid_ros', path=site_packages):
        return installed
    pytest.skip('armid_ros is not installed in this environment: run make')


@pytest.fixture(scope='session')
def prefix(distribution):
    """Return the installation prefix of armid_ros."""
    return Path(sys.prefix)
