# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated arms with elastic joints: plants, drives and trajectories."""
