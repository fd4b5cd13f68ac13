# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From recordings to rows, their noise, and the unit of a gap."""
