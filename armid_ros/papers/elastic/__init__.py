# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Elastic joints after the source of the shipped two-link arm: identified and reported."""
