# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Least squares of arms, and identifiability of their parameters."""
