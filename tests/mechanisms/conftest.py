# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Each machine with coupled joints."""

import pytest

from tests.mechanisms.machines import load, MACHINES


@pytest.fixture(scope='module', params=MACHINES)
def name(request):
    return request.param


@pytest.fixture(scope='module')
def robot(name, tmp_path_factory):
    return load(name, tmp_path_factory.mktemp('machine'))
