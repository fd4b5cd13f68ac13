# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the source tree is, and where it has been installed."""

from importlib import metadata
from pathlib import Path
import sys

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope='session')
def root():
    """Return the folder of package.xml."""
    return ROOT


@pytest.fixture(scope='session')
def prefix():
    """Return the prefix that armid_ros is installed in; skip the test in a bare source tree."""
    try:
        installed = metadata.distribution('armid_ros').locate_file('')
    except metadata.PackageNotFoundError:
        installed = ROOT
    if not Path(installed).is_relative_to(sys.prefix):
        pytest.skip('armid_ros is not installed in this environment: run make')
    return Path(sys.prefix)
