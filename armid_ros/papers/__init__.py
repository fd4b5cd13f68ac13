# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plug-ins that repeat published methods, one paper each; no other room imports a plug-in."""
