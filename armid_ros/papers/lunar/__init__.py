# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reproduction of the experiments of the lunar paper with a humanoid arm."""
