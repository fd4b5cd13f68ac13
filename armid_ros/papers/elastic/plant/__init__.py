# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Experiments that the simulated two-link arm is given, and what its sensors make of them."""
