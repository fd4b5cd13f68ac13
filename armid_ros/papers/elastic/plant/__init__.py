# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated experiments with the two-link arm, and its sensors."""
