# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ties to another machine that was recorded with the arm."""
