# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Exoskeleton and wearer: simulation, identification of the straps, and report."""
