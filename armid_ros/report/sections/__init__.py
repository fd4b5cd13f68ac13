# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Sections that several pages share."""
