# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Geometry of the bodies of an arm: clearance, floor, obstacles and collision-free paths."""
