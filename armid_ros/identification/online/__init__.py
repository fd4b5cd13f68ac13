# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Identification sample by sample, and what changes on the way."""
