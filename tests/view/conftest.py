# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the viewing nodes have in common."""

from tests.ros.conftest import bench

__all__ = ['bench']
