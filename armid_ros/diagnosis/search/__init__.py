# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which causes explain a gap: trials of every candidate on held-out data, the best first."""
