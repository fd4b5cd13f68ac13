# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the tests of the viewing nodes."""

from tests.ros.conftest import bench

__all__ = ['bench']
